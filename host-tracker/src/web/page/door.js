// The screen beside a door: asks the entrant how many people go in, and says what happens.

import { LINK, PHASE } from "/names.js";
import { ask, repeat, send, stamp } from "/net.js";
import { say, tell, word } from "/words.js";

/** Between an answer and the next question. */
const EVERY_MS = 300;
/** An answer that takes longer is none: what the screen shows is older than that. */
const ANSWER_MS = 2000;
const name = decodeURIComponent(location.pathname.split("/").pop());
const path = `/api/door/${encodeURIComponent(name)}`;
const find = (id) => document.getElementById(id);
/** Keys that there are before the door is known. */
const USUAL = 9;
/** All that a door can ask for; the room for the longest is reserved, so that no key ever moves. */
const PROMPTS = [
  "starting",
  "ready",
  "how-many",
  "counting",
  "go-in",
  "closing",
  "let-shut",
  "out-of-order",
  "called",
  "not-seen",
  "count-again",
  "stand-apart",
  "begin-again",
].map((name) => word("prompt", name));
let ahead_ms = 0;
let shown = "";

/** Keeps the token in this browser; false where that keeps nothing. */
function keep(token) {
  try {
    localStorage.setItem("token", token);
    return true;
  } catch {
    return false;
  }
}

/** The token that this browser keeps, or null. */
function kept() {
  try {
    return localStorage.getItem("token");
  } catch {
    return null;
  }
}

// The screen's token comes once, in its link: /door/front#token=kehai_…, which no server is sent. It is kept in this browser, or
// else stays in the address, where it is found when the page is loaded again.
const given = /^#token=(\w+)$/.exec(location.hash)?.[1];
if (given && keep(given)) history.replaceState(null, "", location.pathname + location.search);
const token = given ?? kept();
const rights = token ? { Authorization: `Bearer ${token}` } : {};

const keys = [];

/** Adds the keys that are missing up to a number. */
function addKeys(most) {
  for (let number = keys.length + 1; number <= most; number += 1) {
    const key = document.createElement("button");
    key.type = "button";
    key.textContent = number;
    key.disabled = true;
    // How many there are is known by the first answer.
    key.classList.add("unknown");
    key.addEventListener("click", () => enter(number));
    find("keys").append(key);
    keys.push(key);
  }
}
addKeys(USUAL);

async function enter(number) {
  keys.forEach((key) => {
    key.disabled = true;
  });
  // Stamps are in the tracker's time: a tablet's clock may be anything.
  const at_ms = Date.now() + ahead_ms;
  try {
    await send("POST", `${path}/number`, { ...stamp(at_ms), number }, rights);
    tell(find("why"), null);
  } catch (error) {
    tell(find("why"), error);
  }
  shown = "";
  lookAgain();
}

/** Sentences that are not said, in the place of the one that is: they take the room of the longest. */
function reserve(place, sentences) {
  find(place).parentElement.append(...sentences.map((sentence) => {
    const unsaid = document.createElement("span");
    unsaid.className = "unsaid";
    unsaid.ariaHidden = "true";
    unsaid.textContent = sentence;
    return unsaid;
  }));
}

function show(door) {
  const text = JSON.stringify({ ...door, unix_ms: 0, passages: [] });
  if (text === shown) return;
  shown = text;
  document.body.dataset.phase = door.phase;
  find("name").textContent = door.name;
  find("prompt").textContent = word("prompt", door.prompt_name);
  const tries = say("screen.tries", { n: door.tries_left });
  find("tries").textContent = door.phase === PHASE.ASKED ? tries : "";
  const asks = door.phase === PHASE.ASKED;
  addKeys(door.people_max);
  find("keys").classList.toggle("many", door.people_max > USUAL);
  keys.forEach((key, index) => {
    key.disabled = !asks;
    key.hidden = index >= Math.max(3, door.people_max);
    key.classList.remove("unknown");
    key.classList.toggle("entered", !asks && door.entered === index + 1);
  });
  find("people").replaceChildren(
    ...Array.from({ length: Math.max(door.entered, door.people_max) }, (_, index) => {
      const person = document.createElement("li");
      person.classList.toggle("in", index < door.through);
      person.classList.toggle("none", index >= door.entered);
      return person;
    }),
  );
}

function link(state, words) {
  find("link").dataset.state = state;
  find("link").lastElementChild.textContent = words;
}

async function look() {
  try {
    const door = await ask(path, { headers: rights, signal: AbortSignal.timeout(ANSWER_MS) });
    ahead_ms = door.unix_ms - Date.now();
    if (document.body.dataset.phase === PHASE.LOST) tell(find("why"), null);
    show(door);
    link(LINK.LIVE, say("screen.connected"));
  } catch (error) {
    shown = "";
    document.body.dataset.phase = PHASE.LOST;
    find("prompt").textContent = say("screen.lost");
    tell(find("why"), error);
    keys.forEach((key) => {
      key.disabled = true;
    });
    link(LINK.LOST, say("screen.not-connected"));
  }
}

addEventListener("keydown", ({ key, repeat, ctrlKey, altKey, metaKey }) => {
  const button = keys[Number(key) - 1];
  // With these it is for the browser, as Ctrl+1 for its first tab.
  if (ctrlKey || altKey || metaKey || repeat) return;
  if (button && !button.disabled && !button.hidden) enter(Number(key));
});
reserve("prompt", [...PROMPTS, say("screen.wait"), say("screen.lost")]);
reserve("tries", [1, 2, 9].map((n) => say("screen.tries", { n })));
const lookAgain = repeat(look, EVERY_MS);
