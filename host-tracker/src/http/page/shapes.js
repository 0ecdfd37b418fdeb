// The parts of a site, all alike: a kind, a name, corners, and whether they close. Also SVG elements and small geometry.

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

/** Corners as a path. */
export const path = (points, closed) =>
  points.length ? `M${points.map(([x, y]) => `${x.toFixed(3)} ${(-y).toFixed(3)}`).join("L")}${closed ? "Z" : ""}` : "";

export const KINDS = {
  zone: { word: "Zone", corners: "polygon", closed: true, least: 3 },
  wall: { word: "Wall", corners: "points", closed: false, least: 2 },
  entry: { word: "Entry", corners: "line", closed: false, least: 2, most: 2 },
  mover: { word: "Mover", corners: "polygon", closed: true, least: 3 },
  module: { word: "Module", least: 1, most: 1 },
};

/** Corners of a part. */
export const corners = (kind, part) => (kind === "module" ? [[part.x, part.y]] : part[KINDS[kind].corners]);

/** Gives a part other corners. */
export function setCorners(kind, part, points) {
  const round = points.map((point) => point.map((metres) => Math.round(metres * 1000) / 1000));
  if (kind === "module") [[part.x, part.y]] = round;
  else part[KINDS[kind].corners] = round;
}

/** A new part of a kind, with a name nobody else has. */
export function create(kind, points, site) {
  const taken = new Set((site[kind] ?? []).map((part) => part.name));
  let number = 1;
  while (taken.has(`${kind} ${number}`)) number += 1;
  const name = `${kind} ${number}`;
  const part = {
    zone: { name, count: true, secure: false, enclosed: false },
    wall: { blocks: ["people", "beams"], reflectance: 0.53, mirror: false },
    entry: { name, zone: null },
    mover: { name },
    module: { name, yaw_deg: 0, height_m: 0.6 },
  }[kind];
  setCorners(kind, part, points);
  return part;
}

/** [left, low, right, high] of all there is; null of nothing. */
export function bounds(site) {
  const points = Object.keys(KINDS).flatMap((kind) => (site[kind] ?? []).flatMap((part) => corners(kind, part)));
  if (!points.length) return null;
  const [xs, ys] = [0, 1].map((axis) => points.map((point) => point[axis]));
  const [left, low, right, high] = [Math.min(...xs), Math.min(...ys), Math.max(...xs), Math.max(...ys)];
  const least = 2;
  return [Math.min(left, (left + right - least) / 2), Math.min(low, (low + high - least) / 2),
    Math.max(right, (left + right + least) / 2), Math.max(high, (low + high + least) / 2)];
}

function inside([x, y], polygon) {
  let within = false;
  polygon.forEach(([ax, ay], index) => {
    const [bx, by] = polygon.at(index - 1);
    if (ay > y !== by > y && x < ((bx - ax) * (y - ay)) / (by - ay) + ax) within = !within;
  });
  return within;
}

/** Those of a frame or line that somebody is sure of and that are in a zone; without zones, anywhere. */
export function people(line, site) {
  const zones = site.zone ?? [];
  return line.tracks.filter(({ state, x, y }) =>
    state !== "tentative" && (!zones.length || zones.some((zone) => inside([x, y], zone.polygon))));
}

/** How a module is: "good", "warn", "bad", or "none" when nothing was heard of it. */
export function health(line) {
  if (!line) return "none";
  if (line.state === "missing" || line.alarms.some(({ name }) => ["silent", "sensor", "covered"].includes(name))) return "bad";
  return line.alarms.length ? "warn" : "good";
}
