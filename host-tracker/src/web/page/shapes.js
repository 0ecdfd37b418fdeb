// The parts of a site, all alike: a kind, a name, corners, and whether they close. Also SVG elements and small geometry.

import { gone, newDoor } from "./door-part.js";
import { BLOCKS, FAILED, HEALTH, KIND, MODULE, ORIGIN, TRACK } from "./names.js";
import { say, word } from "./words.js";

const NS = "http://www.w3.org/2000/svg";

/** An SVG element with attributes and children. */
export function svg(name, attributes = {}, ...children) {
  const element = document.createElementNS(NS, name);
  for (const [key, value] of Object.entries(attributes)) if (value != null) element.setAttribute(key, value);
  element.append(...children);
  return element;
}

/** An HTML element with properties and children. */
export function html(name, properties = {}, ...children) {
  const element = document.createElement(name);
  for (const [key, value] of Object.entries(properties)) {
    if (key === "dataset") Object.assign(element.dataset, value);
    else if (key.startsWith("aria-") || key === "for" || key === "role") element.setAttribute(key, value);
    else element[key] = value;
  }
  element.append(...children);
  return element;
}

/** Gives an element another text; in vain it is left alone, as it may be read aloud. */
export function put(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

/** A pattern of stripes, for what is not known; `size` apart and `wide`. */
export const stripes = (id, kind, size, wide) =>
  svg(
    "pattern",
    { id, width: size, height: size, patternUnits: "userSpaceOnUse", patternTransform: "rotate(45)" },
    svg("rect", { class: kind, width: size, height: wide }),
  );

/** [left, low, right, high] of points. */
export function box(points) {
  const [xs, ys] = [0, 1].map((axis) => points.map((point) => point[axis]));
  return [Math.min(...xs), Math.min(...ys), Math.max(...xs), Math.max(...ys)];
}

/** The mean of points. */
export const middle = (points) =>
  [0, 1].map((axis) => points.reduce((sum, point) => sum + point[axis], 0) / points.length);

/** Corners as a path. */
export const path = (points, closed) =>
  points.length
    ? `M${points.map(([x, y]) => `${x.toFixed(3)} ${(-y).toFixed(3)}`).join("L")}${closed ? "Z" : ""}`
    : "";

/** Grid of the editor. */
export const GRID_M = 0.05;

/** The editor's tool that draws nothing; the others are the kinds of parts. */
export const SELECT = "select";

/** The key of the corners of each kind of part, whether they close, and how many there are. */
export const KINDS = {
  [KIND.ZONE]: { corners: "polygon", closed: true, least: 3 },
  [KIND.WALL]: { corners: "points", closed: false, least: 2 },
  [KIND.ENTRY]: { corners: "line", closed: false, least: 2, most: 2 },
  [KIND.LINE]: { closed: false, least: 2, most: 2 },
  [KIND.MOVER]: { corners: "polygon", closed: true, least: 3 },
  [KIND.EXCLUDE]: { corners: "polygon", closed: true, least: 3 },
  [KIND.DOOR]: { corners: "line", closed: false, least: 2, most: 2 },
  [KIND.MODULE]: { least: 1, most: 1 },
};

/** Whether the place of a module is known; until then it waits in the tray. */
export const isPlaced = (module) => module.placed !== false;

/** What a part is called; one without a name by its number among its kind, from 0. */
export const called = (kind, part, index) =>
  part.name || say("edit.part", { kind: word("part", kind), name: index + 1 });

/** The names of the zones in which people are counted: all, if the site counts in none. */
export function countedZones(site) {
  const all = site.zone ?? [], counted = all.filter((zone) => zone.count);
  return (counted.length ? counted : all).map((zone) => zone.name);
}

/** Corners of a part. */
export const corners = (kind, part) =>
  kind === KIND.MODULE
    ? [[part.x, part.y]]
    : kind === KIND.LINE
    ? [part.from, part.to]
    : part[KINDS[kind].corners];

/** Gives a part other corners. */
export function setCorners(kind, part, points) {
  const round = points.map((point) => point.map((metres) => Math.round(metres * 1000) / 1000));
  if (kind === KIND.MODULE) {
    [[part.x, part.y]] = round;
    // Where somebody has put it, it is placed.
    delete part.placed;
  } else if (kind === KIND.LINE) [part.from, part.to] = round;
  else if (kind === KIND.DOOR) moveDoor(part, round);
  else part[KINDS[kind].corners] = round;
}

/** Gives a door another line; where cards are shown goes along with one that is moved whole. */
function moveDoor(door, line) {
  const by = door.reader && gone(door.line, line);
  if (by) door.reader = door.reader.map((metres, axis) => Math.round((metres + by[axis]) * 1000) / 1000);
  door.line = line;
}

/** A name that no other part of a kind has: these words and the first number that is free. */
export function freeName(kind, words, site) {
  const taken = new Set((site[kind] ?? []).map((part) => part.name));
  let number = 1;
  while (taken.has(`${words} ${number}`)) number += 1;
  return `${words} ${number}`;
}

/** A new part of a kind, with a name of its own. */
export function create(kind, points, site) {
  const name = freeName(kind, kind === KIND.MODULE ? kind : word("part", kind), site);
  const part = {
    [KIND.ZONE]: { name, count: true, secure: false, enclosed: false },
    [KIND.WALL]: { blocks: [BLOCKS.PEOPLE, BLOCKS.BEAMS], mirror: false },
    [KIND.ENTRY]: { name, zone: null },
    [KIND.LINE]: { name },
    [KIND.MOVER]: { name },
    [KIND.EXCLUDE]: { name },
    [KIND.DOOR]: kind === KIND.DOOR && newDoor(name, points, site.zone ?? []),
    [KIND.MODULE]: { name, yaw_deg: 0, height_m: 0.6 },
  }[kind];
  setCorners(kind, part, points);
  return part;
}

/** [left, low, right, high] of all there is; null of nothing. */
export function bounds(site) {
  const points = Object.keys(KINDS).flatMap((kind) =>
    (site[kind] ?? []).filter(isPlaced).flatMap((part) => corners(kind, part))
  );
  if (!points.length) return null;
  const [left, low, right, high] = box(points);
  const least = 2;
  return [
    Math.min(left, (left + right - least) / 2),
    Math.min(low, (low + high - least) / 2),
    Math.max(right, (left + right + least) / 2),
    Math.max(high, (low + high + least) / 2),
  ];
}

function inside([x, y], polygon) {
  let within = false;
  polygon.forEach(([ax, ay], index) => {
    const [bx, by] = polygon.at(index - 1);
    if (ay > y !== by > y && x < ((bx - ax) * (y - ay)) / (by - ay) + ax) within = !within;
  });
  return within;
}

/** Whether the tracker counts a track: never a part of another one, and one that was never seen to come in where a zone is secure. */
function isPerson({ origin = ORIGIN.ENTERED, state, x, y }, zones) {
  if (origin === ORIGIN.UNEXPLAINED) {
    return zones.some((zone) => zone.secure && inside([x, y], zone.polygon));
  }
  return origin === ORIGIN.ENTERED && state !== TRACK.TENTATIVE;
}

/** The tracks of a frame that the tracker counts and that lie in a zone; without zones, anywhere but where nobody is counted. */
export function people(line, site) {
  const zones = site.zone ?? [], excludes = site.exclude ?? [];
  return line.tracks.filter((track) => {
    const isIn = ({ polygon }) => inside([track.x, track.y], polygon);
    return isPerson(track, zones) && !excludes.some(isIn) && (!zones.length || zones.some(isIn));
  });
}

/** Whether the number of people in a zone is known: 0 is only said where all of it is seen. */
export const isCounted = (zone) => (zone?.count ?? null) !== null;

/** How many people are here, null where that is not known, and the zones of which it is not. What the tracker said is so; a line of
 * the database has no total. Without zones it is known while a device watches whose place is known; what modules were doing in the
 * past (null) is not kept. */
export function total(line, site, modules) {
  const names = countedZones(site);
  const open = names.filter((name) => !isCounted(line.zones?.[name]));
  const count = people(line, site).length;
  const known = names.length
    ? open.length < names.length && (count > 0 || !open.length)
    : [...(site.module ?? []).filter(isPlaced), ...(site.floor ?? [])].some(({ name }) =>
      !modules || modules.some((line) => line.name === name && line.state === MODULE.WATCHING)
    );
  return { count: line.total ? line.total.count ?? null : known ? count : null, open };
}

/** Whether a frame or a line of history says what is so at the time that is shown; `isCurrent`: it is of that time. */
export const isKnown = (line, isCurrent) => Boolean(line) && !line.noTracker && !line.isUnknown && isCurrent;

/** What the newest frame says of now: nothing of all this unless that is known. */
export function ofNow(frame, known) {
  const { modules = [], doors = [], floors = [], lines = [] } = (known && frame) || {};
  return { modules, doors, floors, lines };
}

/** Whether a figure of a module is known; one that is missing has measured nothing. */
export const isMeasured = (line, figure) =>
  Boolean(line) && line.state !== MODULE.MISSING && (line[figure] ?? null) !== null;

/** A figure of a module in words, a dash where it is not known. */
export const measured = (line, figure, words) => isMeasured(line, figure) ? words(line[figure]) : "–";

/** Health of a module by its line of a frame; NONE without a line, and of one that is not used. */
export function health(line) {
  if (!line || line.state === MODULE.FOUND) return HEALTH.NONE;
  if (
    line.state === MODULE.MISSING || line.alarms.some(({ severity }) => severity === FAILED)
  ) return HEALTH.BAD;
  return line.alarms.length ? HEALTH.WARN : HEALTH.GOOD;
}
