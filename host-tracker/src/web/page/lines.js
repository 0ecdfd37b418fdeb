// Counting lines on the map: an arrow to the side that is in, and how many went in and out.

import { keepFocus } from "./focus.js";
import { ZONE } from "./names.js";
import { middle, path, put, svg } from "./shapes.js";
import { say } from "./words.js";

const ARROW_PX = 22;
const HEAD_PX = 6;

/** What is read aloud of a line: a button that asks why its count, in words, is so; null: not known. */
const figure = (name, count) => say("line.figure", { line: name, count: count ?? say("zone.unknown-count") });

/** A line with its arrow and its label, as one group. */
function line({ name, from, to }, px) {
  const [x, y] = middle([from, to]);
  const length = Math.hypot(to[0] - from[0], to[1] - from[1]) || 1;
  // To the left of the way from one end to the other.
  const [left, up] = [(from[1] - to[1]) / length, (to[0] - from[0]) / length];
  const at = (along, beside) => [
    x + left * along * px + up * beside * px,
    y + up * along * px - left * beside * px,
  ];
  const tip = at(ARROW_PX, 0), back = ARROW_PX - HEAD_PX;
  const [textX, textY] = at(ARROW_PX + 14, 0);
  return svg(
    "g",
    { class: "line-group", "data-line": name, tabindex: 0, role: "button", "aria-label": figure(name, null) },
    svg("path", { class: "line", d: path([from, to]) }),
    svg("path", {
      class: "line arrow",
      d: path([at(0, 0), tip]) + path([at(back, -HEAD_PX), tip, at(back, HEAD_PX)]),
    }),
    svg("text", { class: "line-name", x: textX, y: -textY, dy: ".35em", "text-anchor": "middle" }, name),
  );
}

/** Draws the lines of a site. */
export function drawLines(layer, site, px) {
  const lines = (site.line ?? []).map((one) => line(one, px));
  keepFocus(layer, "line", () => layer.replaceChildren(...lines));
}

/** Writes beside each line how often it was crossed; `frame`: the lines of a frame. What was never seen is not known. */
export function drawCounts(layer, frame) {
  const byName = new Map(frame.map((one) => [one.name, one]));
  for (const group of layer.children) {
    const { name, in: inward = null, out: outward = null, state } = byName.get(group.dataset.line) ??
      { name: group.dataset.line };
    const counted = inward === null ? null : say("map.in-out", { in: inward, out: outward });
    const label = byName.has(name) ? `${name} · ${counted ?? "?"}` : name;
    put(group.querySelector("text"), label);
    const aloud = figure(name, counted);
    if (group.getAttribute("aria-label") !== aloud) group.setAttribute("aria-label", aloud);
    group.classList.toggle("unknown", state !== undefined && state !== ZONE.KNOWN);
  }
}
