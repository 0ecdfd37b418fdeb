// The card of a guarded door in the editor: the zone before it, what its lock does in trouble, where cards are shown, and its times.

import { besideDoor } from "./door-part.js";
import { FAIL } from "./names.js";
import { html } from "./shapes.js";
import { say, word } from "./words.js";

/** What is said of keys, by what the door does without them. */
function aboutKeys({ without_keys, fail }) {
  if (without_keys) return say("field.keys-none");
  return say(fail === FAIL.SAFE ? "field.keys-unlocked" : "field.keys-locked");
}

/** The zones to choose from, [name, words]; one that is gone is there until another is chosen. */
function zones(site, door) {
  const names = (site.zone ?? []).map(({ name }) => name);
  const gone = names.includes(door.zone) ? [] : [door.zone];
  return [...gone, ...names].map((name) => [name, name || say("field.guards-none")]);
}

/** Offers to make the zone secure, which one of a door must be. */
function makeSecure(site, door, change) {
  const zone = (site.zone ?? []).find(({ name }) => name === door.zone);
  if (!zone || zone.secure) return [];
  const onclick = change(() => zone.secure = true);
  const words = say("field.make-secure", { zone: zone.name });
  return [html("button", { type: "button", className: "button", id: "make-secure", onclick }, words)];
}

/** The fields of a door. */
export function doorFields({ site }, door, change, { name, choice, tick, flag, place, whole, number }) {
  const seconds = (key) => number(word("field", key), key, "s", "field.seconds");
  const elsewhere = tick(
    say("field.reader"),
    "elsewhere",
    Boolean(door.reader),
    (on) => on ? door.reader = besideDoor(door.line) : delete door.reader,
  );
  const keys = flag(say("field.without_keys"), "without_keys");
  const about = html("p", { className: "fine", id: "about-keys", role: "status" }, aboutKeys(door));
  const believes = keys.querySelector("input");
  believes.setAttribute("aria-describedby", `${believes.getAttribute("aria-describedby")} about-keys`);
  return [
    name(),
    choice(say("field.guards"), "zone", zones(site, door), (zone) => door.zone = zone),
    ...makeSecure(site, door, change),
    choice(
      say("field.fail"),
      "fail",
      Object.values(FAIL).map((fail) => [fail, word("fail", fail)]),
      (fail) => door.fail = fail,
    ),
    keys,
    about,
    elsewhere,
    ...(door.reader ? [place("reader")] : []),
    whole(say("field.group"), "people_max"),
    whole(word("field", "tries_max"), "tries_max"),
    ...["ask_s", "check_s", "pass_s", "next_s", "close_s", "passback_s", "exit_s"].map(seconds),
  ];
}
