// Counting lines on the map: an arrow to the side that is in, and how many went in and out.

import { ZONE } from "./names.js";
import { middle, path, put, svg } from "./shapes.js";
import { say } from "./words.js";

const ARROW_PX = 22;
const HEAD_PX = 6;

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
    { class: "line-group", "data-line": name },
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
  layer.replaceChildren(...(site.line ?? []).map((one) => line(one, px)));
}

/** Writes beside each line how often it was crossed; `frame`: the lines of a frame. What was never seen is not known. */
export function drawCounts(layer, frame) {
  const byName = new Map(frame.map((one) => [one.name, one]));
  for (const group of layer.children) {
    const { name, in: inward = null, out: outward = null, state } = byName.get(group.dataset.line) ??
      { name: group.dataset.line };
    const counted = inward === null ? "?" : say("map.in-out", { in: inward, out: outward });
    const label = byName.has(name) ? `${name} · ${counted}` : name;
    put(group.querySelector("text"), label);
    group.classList.toggle("unknown", state !== undefined && state !== ZONE.KNOWN);
  }
}
