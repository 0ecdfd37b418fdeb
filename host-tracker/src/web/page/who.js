// Who has logged in: hides what they may not do, and leaves for the log-in page when it is nobody.

import { ask, LOGGED_OUT } from "./net.js";

const find = (id) => document.getElementById(id);
const leave = () => location.replace(`/login.html${location.hash}`);

/** Asks who it is; without an answer everything stays as it is: the tracker refuses what may not be. */
export async function who() {
  const answer = await ask("/api/session").catch(() => null);
  if (!answer) return;
  const { needed, name, role, may } = answer;
  if (needed && name === null) leave();
  document.body.classList.toggle("no-edit", !may.includes("edit"));
  document.body.classList.toggle("no-edit-doors", !may.includes("edit-doors"));
  find("log-out").hidden = !needed;
  find("log-out").title = needed ? `${name}, ${role}` : "";
}

addEventListener(LOGGED_OUT, leave);
find("log-out").onclick = async () => {
  await ask("/api/session", { method: "DELETE" }).catch(() => null);
  leave();
};
