// The screen beside a door: asks the entrant how many people go in, and says what happens.

import { LINK, PHASE } from "/names.js";
import { ask } from "/net.js";

const EVERY_MS = 300;
const name = decodeURIComponent(location.pathname.split("/").pop());
const path = `/api/door/${encodeURIComponent(name)}`;
const find = (id) => document.getElementById(id);
const MOST = 9;
let ahead_ms = 0;
let shown = "";

// The screen's token comes once, in its link: /door/front#token=kehai_…, which no server is sent. It is kept in this browser.
const given = /^#token=(\w+)$/.exec(location.hash)?.[1];
if (given) {
  localStorage.setItem("token", given);
  history.replaceState(null, "", location.pathname);
}
const token = localStorage.getItem("token");
const rights = token ? { Authorization: `Bearer ${token}` } : {};

const keys = Array.from({ length: MOST }, (_, index) => {
  const key = document.createElement("button");
  key.type = "button";
  key.textContent = index + 1;
  key.disabled = true;
  key.addEventListener("click", () => enter(index + 1));
  find("keys").append(key);
  return key;
});

async function enter(number) {
  keys.forEach((key) => {
    key.disabled = true;
  });
  // Stamps are in the tracker's time: a tablet's clock may be anything. They number the messages as well.
  const at_ms = Date.now() + ahead_ms;
  const body = JSON.stringify({ id: at_ms, at_ms, number });
  try {
    const headers = { "Content-Type": "application/json", ...rights };
    await ask(`${path}/number`, { method: "POST", headers, body });
    say("");
  } catch (error) {
    say(error.message);
  }
  shown = "";
  look();
}

function say(why) {
  find("why").hidden = why === "";
  find("why").textContent = why;
}

function show(door) {
  const text = JSON.stringify({ ...door, unix_ms: 0, passages: [] });
  if (text === shown) return;
  shown = text;
  document.body.dataset.phase = door.phase;
  find("name").textContent = door.name;
  find("prompt").textContent = door.prompt;
  find("tries").hidden = door.phase !== PHASE.ASKED;
  find("tries").textContent = door.tries_left === 1
    ? "The last try with this card"
    : `${door.tries_left} tries with this card`;
  const asks = door.phase === PHASE.ASKED;
  keys.forEach((key, index) => {
    key.disabled = !asks;
    key.hidden = index >= Math.max(3, door.people_max);
    key.classList.toggle("entered", !asks && door.entered === index + 1);
  });
  find("people").replaceChildren(...Array.from({ length: door.entered }, (_, index) => {
    const person = document.createElement("li");
    person.classList.toggle("in", index < door.through);
    return person;
  }));
}

function link(state, words) {
  find("link").dataset.state = state;
  find("link").lastElementChild.textContent = words;
}

async function look() {
  try {
    const door = await ask(path, { headers: rights });
    ahead_ms = door.unix_ms - Date.now();
    show(door);
    link(LINK.LIVE, "connected");
  } catch (error) {
    shown = "";
    document.body.dataset.phase = PHASE.LOST;
    find("prompt").textContent = "The door does not answer: please call for help";
    keys.forEach((key) => {
      key.disabled = true;
    });
    link(LINK.LOST, error.message);
  }
}

addEventListener("keydown", ({ key, repeat }) => {
  const button = keys[Number(key) - 1];
  if (button && !button.disabled && !repeat) enter(Number(key));
});
look();
setInterval(look, EVERY_MS);
