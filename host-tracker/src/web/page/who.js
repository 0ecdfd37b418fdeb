// Who has logged in: hides what they may not do, and leaves for the log-in page when it is nobody.

import { ask, LOGGED_OUT } from "./net.js";
import { say, word } from "./words.js";

const find = (id) => document.getElementById(id);
const leave = () => location.replace(`/login.html${location.hash}`);

/** Asks who it is; without an answer everything stays as it is: the tracker refuses what may not be. */
export async function who() {
  const answer = await ask("/api/session").catch(() => null);
  if (!answer) return;
  const { needed, name, role, may } = answer;
  if (needed && name === null) leave();
  document.body.classList.toggle("no-edit", !may.includes("edit"));
  document.body.classList.toggle("no-modules", !may.includes("modules"));
  document.body.classList.toggle("no-reset", !may.includes("reset"));
  document.body.classList.toggle("no-acknowledge", !may.includes("acknowledge"));
  document.body.classList.toggle("no-edit-doors", !may.includes("edit-doors"));
  find("log-out").hidden = !needed;
  find("log-out").title = needed ? say("bar.who", { name, role: word("role", role) }) : "";
}

const has = (mark) => document.body.classList.contains(mark);
/** Whether this visitor may change the site: one with doors is changed by few. */
export const mayChangeSite = () => !has("no-edit") && !(has("guarded") && has("no-edit-doors"));
/** Whether they may ask modules for something. */
export const mayAskModules = () => !has("no-modules") && !(has("guarded") && has("no-edit-doors"));

addEventListener(LOGGED_OUT, leave);
find("log-out").onclick = async () => {
  await ask("/api/session", { method: "DELETE" }).catch(() => null);
  leave();
};
