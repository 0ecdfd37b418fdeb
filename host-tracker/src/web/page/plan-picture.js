// A site as a picture that prints: walls, zones, modules, and what is drawn beneath them.

import { BLOCKS } from "./names.js";
import { bounds, isPlaced, middle, path, stripes, svg } from "./shapes.js";

const MARGIN_M = 0.4;
let patterns = 0;

/** The picture of a site; `beneath` is called with a layer below the walls and the id of a pattern of stripes. */
export function planPicture(site, label, beneath) {
  const around = bounds(site);
  if (!around) return svg("svg", { class: "plan", viewBox: "0 0 1 1", role: "img", "aria-label": label });
  const [left, low, right, high] = around;
  const [width, height] = [right - left + 2 * MARGIN_M, high - low + 2 * MARGIN_M];
  const px = width / 720;
  const id = `stripes-${patterns += 1}`;
  const layer = svg("g");
  beneath(layer, id);
  const text = (x, y, kind, words) =>
    svg("text", { class: kind, x, y: -y, "font-size": 13 * px, "text-anchor": "middle" }, words);
  return svg(
    "svg",
    {
      class: "plan",
      viewBox: `${left - MARGIN_M} ${-high - MARGIN_M} ${width} ${height}`,
      role: "img",
      "aria-label": label,
    },
    svg("defs", {}, stripes(id, "chart-hatch", 0.14, 0.035)),
    layer,
    ...(site.zone ?? []).map(({ polygon }) => svg("path", { class: "plan-zone", d: path(polygon, true) })),
    ...(site.wall ?? []).map(({ points, blocks }) =>
      svg("path", {
        class: blocks.includes(BLOCKS.BEAMS) ? "plan-wall" : "plan-wall glass",
        d: path(points),
        "stroke-width": 3 * px,
      })
    ),
    ...(site.line ?? []).map(({ from, to }) =>
      svg("path", { class: "plan-line", d: path([from, to]), "stroke-width": 2 * px })
    ),
    ...(site.module ?? []).filter(isPlaced).flatMap(({ name, x, y, yaw_deg }) => {
      const rad = (yaw_deg * Math.PI) / 180, far = 16 * px;
      return [
        svg("circle", { class: "plan-module", cx: x, cy: -y, r: 5 * px }),
        text(x + Math.cos(rad) * far, y + Math.sin(rad) * far, "plan-name", name),
      ];
    }),
    ...(site.zone ?? []).map(({ name, polygon }) => {
      const [x, y] = middle(polygon);
      return text(x, y, "plan-zone-name", name);
    }),
  );
}
