// How long people were where: cells from cool to warm; hatched where nobody looked.

import { path, svg } from "./shapes.js";
import { exactly } from "./words.js";

export const STEPS = 6;

/** How large a cell is. */
export const square = (cell_m) => `${exactly(cell_m)} × ${exactly(cell_m)}`;

/** Cells of a step as one path: rectangles of each row that belong together. */
function cellsOf({ x, y, cell_m, columns, rows }, is) {
  const pieces = [];
  for (let row = 0; row < rows; row += 1) {
    for (let column = 0; column < columns; column += 1) {
      if (!is(row * columns + column)) continue;
      let end = column + 1;
      while (end < columns && is(row * columns + end)) end += 1;
      const [left, right] = [x + column * cell_m, x + end * cell_m];
      const [low, high] = [y + row * cell_m, y + (row + 1) * cell_m];
      pieces.push(path([[left, low], [right, low], [right, high], [left, high]], true));
      column = end;
    }
  }
  return pieces.join("");
}

/** The upper bounds of the steps, s: each a third of the next, up to what the warmest cell has. */
export function bounds(heat) {
  const most = heat.cells.reduce((one, other) => Math.max(one, other ?? 0), 0);
  return Array.from({ length: STEPS }, (_, step) => most / 3 ** (STEPS - 1 - step));
}

/** Fills a layer of a map whose units are metres; `hatch`: the id of a pattern of it. */
export function drawHeat(layer, heat, hatch) {
  const limits = bounds(heat);
  const step = (cell) => {
    const time = heat.cells[cell];
    return time === null ? -1 : time > 0 ? limits.findIndex((limit) => time <= limit + 1e-9) : STEPS;
  };
  const steps = heat.cells.map((_, cell) => step(cell));
  const shape = (wanted) => cellsOf(heat, (cell) => steps[cell] === wanted);
  layer.replaceChildren(
    svg("path", { class: "heat-unknown", d: shape(-1), fill: `url(#${hatch})` }),
    ...limits.map((_, number) => svg("path", { class: `heat-cell heat-${number}`, d: shape(number) })),
  );
}
