// What the pages that print have in common: tables that become lists on a narrow screen, and keys of colours.

import { html } from "./shapes.js";

/** A table; a cell is its text, or [text, kind]. */
export function table(head, rows) {
  const cell = (value, index) => {
    const [text, kind] = Array.isArray(value) ? value : [value, ""];
    return html("td", { className: kind, dataset: { label: head[index] } }, text);
  };
  return html(
    "table",
    {},
    html("thead", {}, html("tr", {}, ...head.map((word) => html("th", { scope: "col" }, word)))),
    html("tbody", {}, ...rows.map((row) => html("tr", {}, ...row.map(cell)))),
  );
}

/** The key of a colour of the page; without one, of what is hatched. */
export const key = (color) =>
  html("i", { className: color ? "key" : "key hatched", style: color ? `--c:var(--${color})` : "" });
