// The page to log in. The session is a cookie that no script can read.

import { ask, send } from "./net.js";
import { has, say, tell } from "./words.js";

const find = (id) => document.getElementById(id);
/** The map, at the time that the visitor came from. */
const leave = () => location.replace(`/${location.hash}`);

// Until the script is here the form would be sent as a page's own.
find("send").disabled = false;
find("form").addEventListener("submit", async (event) => {
  event.preventDefault();
  find("send").disabled = true;
  try {
    const [name, password] = [find("name").value.trim(), find("password").value];
    await send("POST", "/api/session", { name, password });
    leave();
  } catch (error) {
    // The tracker's sentence has how long to wait; why a log-in fails is told by the status.
    tell(find("why"), has(`login.${error.status}`) ? { message: say(`login.${error.status}`) } : error);
    find("password").value = "";
    find("password").focus();
  }
  find("send").disabled = false;
});

// Who comes by a link from elsewhere is logged in, perhaps; where nobody is known there is nothing to log in to.
const now = await ask("/api/session").catch(() => null);
if (now && (now.name !== null || !now.needed)) leave();
else find("name").focus();
