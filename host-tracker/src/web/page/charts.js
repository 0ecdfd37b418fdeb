// Small charts as SVG: bars and steps over time. What is not known is hatched, and never drawn as 0.

import { stripes, svg } from "./shapes.js";
import { number, say } from "./words.js";

const WIDTH = 720, HEIGHT = 170, LEFT = 40, RIGHT = 8, TOP = 12, BOTTOM = 24;
const PLOT = { width: WIDTH - LEFT - RIGHT, height: HEIGHT - TOP - BOTTOM };
const LABELS = 13; // along the time at most
let patterns = 0;

/** The next larger number that reads well: 1, 2, 5, 10, … */
export function ceiling(value) {
  if (value <= 1) return 1;
  const power = 10 ** Math.floor(Math.log10(value));
  return [1, 2, 5, 10].map((factor) => factor * power).find((one) => one >= value - 1e-9);
}

/** Pieces of bins that are not known: of each a share of its width. */
const unknown = (bins, x, id) =>
  bins.flatMap(({ share }, index) => {
    if (share < 0.005) return [];
    const [left, right] = [x(index), x(index + 1)];
    const width = (right - left) * Math.min(share, 1);
    return [svg("rect", {
      class: "chart-unknown",
      x: (right - width).toFixed(1),
      y: TOP,
      width: width.toFixed(1),
      height: PLOT.height,
      fill: `url(#${id})`,
    })];
  });

/** A frame with a scale, hatched where nothing is known. `bins`: [{label, share of its time that is not known}]. */
function frame(name, summary, bins, most, draw) {
  const id = `unknown-${patterns += 1}`;
  const top = ceiling(most);
  const x = (bin) => LEFT + (PLOT.width * bin) / Math.max(bins.length, 1);
  const y = (value) => TOP + PLOT.height * (1 - value / top);
  const each = Math.ceil(bins.length / LABELS);
  const labels = bins.flatMap(({ label }, index) =>
    index % each ? [] : [
      svg(
        "text",
        { class: "chart-label", x: x(index + 0.5), y: HEIGHT - 7, "text-anchor": "middle" },
        label,
      ),
    ]
  );
  const lines = [0, top / 2, top].map((value) =>
    svg(
      "g",
      {},
      svg("line", { class: "chart-grid", x1: LEFT, x2: WIDTH - RIGHT, y1: y(value), y2: y(value) }),
      svg(
        "text",
        { class: "chart-label", x: LEFT - 6, y: y(value) + 4, "text-anchor": "end" },
        number(value, Number.isInteger(value) ? 0 : 1),
      ),
    )
  );
  return svg(
    "svg",
    {
      class: "chart",
      viewBox: `0 0 ${WIDTH} ${HEIGHT}`,
      role: "img",
      "aria-label": say("chart.summary", { name, summary }),
    },
    svg("defs", {}, stripes(id, "chart-hatch", 6, 2)),
    ...lines,
    ...unknown(bins, x, id),
    ...draw(x, y),
    ...labels,
  );
}

const largest = (values) => Math.max(0, ...values.filter((value) => value !== null));

/** Bars side by side, of each bin one for each of `kinds`: [{key, word}]; a value that is null has none. */
export function bars(name, bins, kinds) {
  const most = largest(bins.flatMap((bin) => kinds.map(({ key }) => bin[key])));
  const sums = kinds.map(({ key, word }) =>
    say("chart.sum", { word, sum: sum(bins, key) ?? say("report.unknown") })
  ).join(", ");
  return frame(name, sums, bins, most, (x, y) =>
    bins.flatMap((bin, index) => {
      const width = (x(index + 1) - x(index)) * 0.8 / kinds.length;
      return kinds.flatMap(({ key, word }, number) =>
        bin[key] === null ? [] : [svg(
          "rect",
          {
            class: `chart-bar ${key}`,
            x: (x(index) + width * (0.125 * kinds.length + number)).toFixed(1),
            y: y(bin[key]).toFixed(1),
            width: Math.max(width - 1, 1).toFixed(1),
            height: (y(0) - y(bin[key])).toFixed(1),
          },
          svg("title", {}, say("chart.bar", { label: bin.label, word, value: bin[key] })),
        )]
      );
    }));
}

/** A step for each bin: `mean` filled, `most` as a line; bins of which nothing is known have none. */
export function steps(name, bins) {
  const most = largest(bins.map((bin) => bin.most));
  return frame(
    name,
    say("chart.most", { n: most }),
    bins,
    most,
    (x, y) =>
      bins.flatMap((bin, index) =>
        bin.mean === null ? [] : [
          svg(
            "rect",
            {
              class: "chart-bar mean",
              x: x(index).toFixed(1),
              y: y(bin.mean).toFixed(1),
              width: (x(index + 1) - x(index)).toFixed(1),
              height: (y(0) - y(bin.mean)).toFixed(1),
            },
            svg(
              "title",
              {},
              say("chart.step", { label: bin.label, mean: number(bin.mean, 1), most: bin.most }),
            ),
          ),
          svg("line", {
            class: "chart-most",
            x1: x(index),
            x2: x(index + 1),
            y1: y(bin.most),
            y2: y(bin.most),
          }),
        ]
      ),
  );
}

/** The sum of what is known; null if nothing is. */
export function sum(bins, key) {
  const known = bins.map((bin) => bin[key]).filter((value) => value !== null);
  return known.length ? known.reduce((one, other) => one + other, 0) : null;
}
