// The page to log in. The session is a cookie that no script can read.

import { ask } from "./net.js";

const find = (id) => document.getElementById(id);
/** The map, at the time that the visitor came from. */
const leave = () => location.replace(`/${location.hash}`);

find("form").addEventListener("submit", async (event) => {
  event.preventDefault();
  find("send").disabled = true;
  const body = JSON.stringify({ name: find("name").value.trim(), password: find("password").value });
  try {
    await ask("/api/session", { method: "POST", headers: { "Content-Type": "application/json" }, body });
    leave();
  } catch (error) {
    find("why").textContent = error.message;
    find("why").hidden = false;
    find("password").value = "";
    find("password").focus();
  }
  find("send").disabled = false;
});

// Who comes by a link from elsewhere is logged in, perhaps; where nobody is known there is nothing to log in to.
const now = await ask("/api/session").catch(() => null);
if (now && (now.name !== null || !now.needed)) leave();
else find("name").focus();
