// Reasons in words, line by line, from what /api/explain tells: closed sets and their facts.
//
//   { zone: { verdict: { is: "seen" }, unseen: [{ size: 1.2, why: { is: "wall" }, … }], … } } ─▶ [{ text }, { text, part: true }, …]

import { sayAbout } from "./alarm-words.js";
import { HIDES, ZONE } from "./names.js";
import {
  age,
  ago,
  clockTime,
  degrees,
  list,
  metres,
  number,
  percent,
  say,
  squareMetres,
  word,
} from "./words.js";

const BRIEF_S = 9.95; // spans below are told with a decimal
const NOW_S = 1;

/** A span, of seconds with a decimal. */
const span = (s) => s < BRIEF_S ? say("age.s", { n: number(s, 1) }) : age(s);
const since = (s) => s < BRIEF_S ? say("age.ago", { age: span(s) }) : ago(s);
const line = (text, more = {}) => ({ text, ...more });
const at = ([x, y]) => ({ x: number(x, 1), y: number(y, 1) });

/** All lines of an answer. */
export const lines = ({ zone, person, alarm, listed }) => [
  ...(listed ? ofListed(listed) : []),
  ...(zone
    ? ofZone(zone)
    : person
    ? ofPerson(person)
    : (alarm ?? []).map((device) => line(ofDevice(device)))),
];

function ofZone(zone) {
  const { is_line, unseen, unseen_more, inside, verdict } = zone;
  const size = (value) => {
    const digits = value < 0.1 ? 2 : 1;
    return is_line ? metres(value, digits) : squareMetres(value, digits);
  };
  const share = percent(zone.seen_share);
  return [
    line(is_line ? say(`why.line-${zone.state}`) : counted(zone)),
    ...(verdict ? [line(ofVerdict(verdict))] : []),
    line(say(unseen.length ? "why.seen-not" : "why.seen-all", { share })),
    ...unseen.map((patch) => {
      const seen = patch.seen_ago_s == null
        ? say("why.never")
        : say("why.seen-ago", { ago: since(patch.seen_ago_s) });
      const facts = { size: size(patch.size), ...at(patch.at), why: hides(patch.why, patch.module), seen };
      return line(say("why.patch", facts), { part: true });
    }),
    ...(unseen_more > 0 ? [line(say("why.patches-more", { size: size(unseen_more) }), { part: true })] : []),
    ...inside.map((one) => line(ofTrack(one))),
  ];
}

function counted({ count, state }) {
  if (count === null) return say("why.number-unknown");
  if (state === ZONE.PARTLY) return say("why.people-least", { n: count });
  return count === 0 ? say("why.nobody") : say("why.people", { n: count });
}

const ofVerdict = ({ is, for_s = 0, m2 = 0 }) =>
  say(`verdict.${is}`, { s: number(for_s, 1), area: squareMetres(m2) });

/** Why a module does not see a place. */
function hides({ is, track }, module) {
  const known = is === HIDES.PERSON && track == null ? "somebody" : is;
  if (module && OF_MODULE.has(is)) return say(`hides.${is}-of`, { module });
  const why = say(`hides.${known}`, { track: String(track) });
  return module && SEEN_FROM.has(is) ? say("hides.from", { why, module }) : why;
}

/** Reasons that are seen from a module; the others are of all. */
const SEEN_FROM = new Set([HIDES.SEEN, HIDES.PERSON, HIDES.THING, HIDES.WALL]);
/** Reasons that are a module's own, which is named. */
const OF_MODULE = new Set([HIDES.SILENT, HIDES.NOT_JUDGED]);

function ofTrack({ track, role, is_inside, probability }) {
  const what = say(`inside.${is_inside ? role : "edge"}`);
  return say("inside.track", { track: String(track), what, share: percent(probability) });
}

function ofPerson(person) {
  const { life, note, zones, modules } = person;
  const facts = { track: String(person.track), share: percent(person.existence), of: String(life.of) };
  const born = person.born_ago_s == null || !person.born_at
    ? []
    : [line(say("life.born", { ago: since(person.born_ago_s), ...at(person.born_at) }))];
  return [
    line(say(`life.${life.is}`, facts)),
    ...born,
    // The tracker's own note of what happened last.
    ...(note ? [line(say("life.last", { note }), { lang: "en" })] : []),
    line(zones.length ? say("life.in", { zones: list(zones) }) : say("life.no-zone")),
    ...(modules.length ? modules.map((one) => line(ofSighting(one))) : [line(say("life.no-module"))]),
  ];
}

function ofSighting({ module, seen_ago_s, why }) {
  const sees = why.is === HIDES.SEEN;
  if (sees && seen_ago_s != null && seen_ago_s < NOW_S) return say("sighting.sees", { module });
  const key = `sighting.${seen_ago_s == null ? "never" : "ago"}${sees ? "-looks" : ""}`;
  return say(key, { module, ago: since(seen_ago_s ?? 0), why: hides(why) });
}

function ofDevice({ device, condition }) {
  if (!condition) return say("device.nothing", { device });
  const { is_on, holds, for_s, raise_s, measured } = condition;
  const figure = measured ? ofFigure(measured) : "";
  const key = is_on ? (holds ? "rings" : "rings-still") : holds ? "not-yet" : "quiet";
  return say(`device.${key}`, { device, figure, age: span(for_s), needed: span(raise_s) });
}

/** How a figure of each unit is written. */
const UNITS = {
  "silent-s": span,
  "damaged-share": (share) => percent(share, 1),
  "covered-deg": (deg) => degrees(deg),
  "scans-hz": (hz) => number(hz, 1),
  "clock-s": (s) => `${number(s * 1000, 1)} ms`,
  "missing-share": (share) => percent(share, 1),
};

const ofFigure = ({ value, limit, unit }) =>
  say(`figure.${unit}`, { value: UNITS[unit](value), limit: UNITS[unit](limit) });

/** Which alarms of that kind stand, and which ended within a day. */
const ofListed = (listed) =>
  listed.length
    ? listed.map((alarm) => {
      const key = alarm.until_ms === undefined ? "listed.stands" : "listed.over";
      const told = {
        about: sayAbout(alarm),
        alarm: word("alarm", alarm.name),
        time: clockTime(alarm.since_ms),
      };
      return line(say(key, told));
    })
    : [line(say("listed.none"))];
