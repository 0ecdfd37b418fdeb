// Where the names on the map stand, in metres of the site: beside what they name, and those of zones where they cover no other.
//
//   ┌ hall · 2 ───── hall · 2 ┐     places for the name of a zone, the first one at the left of the top; that one is taken
//   │         ◁ left          │     which covers least of the names and marks of others, and of two alike the earlier one
//   │                         │
//   └ hall · 2 ───── hall · 2 ┘     people walk: no name goes out of their way, all names are written over them

import { box, isPlaced, middle } from "./shapes.js";
import { say } from "./words.js";

/** A small map has no room for the names of modules: metres a pixel from which on it is one. */
export const NAMES_PX = 0.022;
/** Sizes of letters, in pixels at the usual size of text: those of zones, and of what is smaller. */
const ZONE_PX = 13, SMALL_PX = 11;
/** The usual size of text in pixels, of which `rem` is. */
const REM_PX = 16;
/** Mean width of a letter, and of one of those that are as wide as high, in sizes of letters. */
const LETTER = 0.6, WIDE = 1;
/** Where writing with such letters begins. */
const WIDE_FROM = "\u1100";
/** How far letters reach up and down from the line they stand on, in their size. */
const UP = 0.9, DOWN = 0.3;
/** From the edge of its zone to a name, in sizes of letters. */
const EDGE = 0.8;
/** A count that may stand behind a name: it does not move when the count changes. */
const COUNT = " · 00", CROSSED = "000";
/** Radius of a door's mark, in pixels. */
const DOOR_PX = 17;

/** Size of the letters of all names but those of zones, in metres; the visitor's size of text is `rem` pixels. */
export const small = (px, rem) => (SMALL_PX * px * rem) / REM_PX;

/** Radius of a module, in pixels. */
export const modulePx = (px) => px > NAMES_PX ? 5 : 7;

/** How wide words are, about, in sizes of letters. */
const wide = (words) => [...words].reduce((sum, letter) => sum + (letter >= WIDE_FROM ? WIDE : LETTER), 0);

/** [left, low, right, high] of words that stand on a line at (x, y). */
function boxOf({ x, y, anchor }, words, size) {
  const width = wide(words) * size;
  const left = { start: x, middle: x - width / 2, end: x - width }[anchor];
  return [left, y - DOWN * size, left + width, y + UP * size];
}

/** Where the name of a module stands from it: where it looks; `size` of its letters in metres. */
export function ofModule({ yaw_deg }, px, size) {
  const rad = (yaw_deg * Math.PI) / 180, far = 30 * px, [x, y] = [Math.cos(rad), Math.sin(rad)];
  const anchor = x > 0.4 ? "start" : x < -0.4 ? "end" : "middle";
  return { x: x * far, y: y * far - (y < -0.4 ? 0.8 : 0.35) * size, anchor };
}

/** Where the name of an entry stands: below its middle. */
export function ofEntry({ line }, size) {
  const [x, y] = middle(line);
  return { x, y: y - 1.5 * size, anchor: "middle" };
}

/** Where the name of a counting line stands: on the side that is in. */
export function ofLine({ from, to }, px, size) {
  const [x, y] = middle([from, to]), far = 36 * px;
  const length = Math.hypot(to[0] - from[0], to[1] - from[1]) || 1;
  return {
    x: x + ((from[1] - to[1]) / length) * far,
    y: y + ((to[0] - from[0]) / length) * far - 0.35 * size,
    anchor: "middle",
  };
}

/** Where the name of a door stands: beside its mark. */
export function ofDoor({ line }, size) {
  const [x, y] = middle(line);
  return { x: x + 1.4 * size, y: y - 1.7 * size, anchor: "start" };
}

const around = ([x, y], radius) => [x - radius, y - radius, x + radius, y + radius];

/** What the name of a zone must not cover: [left, low, right, high] of each. */
function taken(site, px, size) {
  const modules = (site.module ?? []).filter(isPlaced).flatMap((module) => {
    const { x, y, name } = module, label = ofModule(module, px, size);
    const named = px > NAMES_PX ? [] : [boxOf({ ...label, x: x + label.x, y: y + label.y }, name, size)];
    return [around([x, y], 3 * modulePx(px) * px), ...named];
  });
  const entries = (site.entry ?? []).map((entry) => boxOf(ofEntry(entry, size), entry.name ?? "", size));
  const lines = (site.line ?? []).map((line) =>
    boxOf(ofLine(line, px, size), `${line.name} · ${say("map.in-out", { in: CROSSED, out: CROSSED })}`, size)
  );
  const doors = (site.door ?? []).flatMap((door) => [
    around(middle(door.line), DOOR_PX * px),
    boxOf(ofDoor(door, size), door.name, size),
  ]);
  const excludes = (site.exclude ?? []).map(({ polygon }) => {
    const [left, low, right, high] = box(polygon);
    const at = { x: (left + right) / 2, y: (low + high) / 2, anchor: "middle" };
    return boxOf(at, say("map.not-counted"), size);
  });
  return [...modules, ...entries, ...lines, ...doors, ...excludes];
}

/** How much of a rectangle another one covers, m². */
function shared([left, low, right, high], [otherLeft, otherLow, otherRight, otherHigh]) {
  const across = Math.min(right, otherRight) - Math.max(left, otherLeft);
  const up = Math.min(high, otherHigh) - Math.max(low, otherLow);
  return Math.max(across, 0) * Math.max(up, 0);
}

/** Places for the name of a zone, the usual one first. */
function candidates(polygon, size) {
  const [left, low, right, high] = box(polygon), edge = EDGE * size;
  const columns = [[left + edge, "start"], [right - edge, "end"], [(left + right) / 2, "middle"]];
  const rows = [high - edge - UP * size, low + edge + DOWN * size, (low + high) / 2 - (UP - DOWN) / 2 * size];
  return rows.flatMap((y) => columns.map(([x, anchor]) => ({ x, y, anchor })));
}

/** Whether a place lies in a polygon. */
function inside([x, y], polygon) {
  let within = false;
  polygon.forEach(([ax, ay], index) => {
    const [bx, by] = polygon.at(index - 1);
    if (ay > y !== by > y && x < ((bx - ax) * (y - ay)) / (by - ay) + ax) within = !within;
  });
  return within;
}

/** The share of a rectangle's corners and middle that is outside of a polygon. */
function outside([left, low, right, high], polygon) {
  const points = [[left, low], [right, low], [right, high], [left, high], [
    (left + right) / 2,
    (low + high) / 2,
  ]];
  return points.filter((point) => !inside(point, polygon)).length / points.length;
}

/** Where the names of `zones` stand, in their order: {x, y, anchor, room}; `room` is how wide they may be. Of metres `px` are a
 * pixel, and `rem` pixels the size of text. The same site at the same size has them at the same places, whoever walks there. */
export function ofZones(zones, site, px, rem = REM_PX) {
  const size = (ZONE_PX * px * rem) / REM_PX, others = taken(site, px, small(px, rem));
  return zones.map(({ name, polygon }) => {
    const [left, , right] = box(polygon), room = right - left - EDGE * size;
    // What has no room is its count alone.
    const words = wide(name + COUNT) * size > room ? COUNT : name + COUNT;
    const all = candidates(polygon, size).map((place) => {
      const own = boxOf(place, words, size), area = (own[2] - own[0]) * (own[3] - own[1]);
      const covered = others.reduce((sum, other) => sum + shared(own, other), 0);
      return { place, own, cost: covered / area + outside(own, polygon) };
    });
    const least = all.reduce((best, one) => one.cost < best.cost - 1e-9 ? one : best);
    others.push(least.own);
    return { ...least.place, room };
  });
}
