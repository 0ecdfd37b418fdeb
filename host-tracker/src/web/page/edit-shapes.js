// What the editor draws over the map: every part that can be chosen, the handles of the chosen one, and the draft.

import { cursorMark } from "./edit-keys.js";
import { lengths } from "./edit-lengths.js";
import { theirShapes } from "./edit-merge.js";
import { BLOCKS, KIND } from "./names.js";
import { corners, KINDS, path, SELECT, svg } from "./shapes.js";
import { say, word } from "./words.js";

/** Distance of the handle that turns a module, in pixels. */
const TURN_PX = 44;
/** From the lowest to the topmost. */
const ORDER = [KIND.ZONE, KIND.MOVER, KIND.EXCLUDE, KIND.WALL, KIND.ENTRY, KIND.LINE, KIND.DOOR, KIND.MODULE];

/** The class of a shape; a door is drawn by its mark, and the editor shows its line only. */
function classOf(kind, { blocks }) {
  if (kind === KIND.DOOR) return "door-line";
  return kind === KIND.WALL && !blocks.includes(BLOCKS.BEAMS) ? "wall glass" : kind;
}

/** All elements of the editor's layer. */
export function editable(editor) {
  const px = editor.view.px, groups = [];
  for (const kind of ORDER) {
    (editor.site[kind] ?? []).forEach((part, index) => {
      const chosen = editor.chosen?.kind === kind && editor.chosen.index === index;
      const closed = KINDS[kind].closed, d = path(corners(kind, part), closed);
      const shape = kind === KIND.MODULE
        ? svg("circle", { cx: part.x, cy: -part.y, r: 16 * px, fill: "transparent" })
        : svg("path", {
          d,
          class: classOf(kind, part),
        });
      const group = svg("g", {
        class: `shape${chosen ? " chosen" : ""}${editor.check.of(kind, index).length ? " wrong" : ""}`,
        "data-kind": kind,
        "data-index": index,
        tabindex: 0,
        role: "button",
        "aria-label": say("edit.part", { kind: word("kind", kind), name: part.name || index + 1 }),
      }, shape);
      if (kind !== KIND.MODULE) group.append(svg("path", { class: "grab", d }));
      group.addEventListener("focus", () => {
        if (!chosen && editor.tool === SELECT && !editor.drag) editor.choose({ kind, index });
      });
      groups.push(group);
    });
  }
  return [
    ...groups,
    ...theirShapes(editor, px),
    ...handles(editor, px),
    ...drafted(editor, px),
    ...cursorMark(editor, px),
  ];
}

/** Corners, places for new corners, and the handle that turns a module. */
function handles(editor, px) {
  const part = editor.part(editor.chosen);
  if (!part || editor.tool !== SELECT) return [];
  const { kind } = editor.chosen, points = corners(kind, part), { closed, most } = KINDS[kind];
  const handle = (extra, [x, y], r, data) =>
    svg("circle", { class: `handle ${extra}`, cx: x, cy: -y, r: r * px, ...data });
  const all = [];
  if (kind === KIND.MODULE) {
    const rad = (part.yaw_deg * Math.PI) / 180;
    all.push(
      handle("turn", [part.x + Math.cos(rad) * TURN_PX * px, part.y + Math.sin(rad) * TURN_PX * px], 8, {
        "data-turn": 1,
      }),
    );
  } else if (!most) {
    points.forEach((point, index) => {
      const next = points[index + 1] ?? (closed ? points[0] : null);
      if (next) {
        all.push(
          handle("mid", [(point[0] + next[0]) / 2, (point[1] + next[1]) / 2], 5.5, { "data-mid": index }),
        );
      }
    });
  }
  if (kind !== KIND.MODULE) {
    points.forEach((point, index) => all.push(handle("", point, 7.5, { "data-corner": index })));
    all.push(...lengths(points, closed, px));
    if (part.reader) all.push(handle("turn", part.reader, 7.5, { "data-reader": 1 }));
  }
  return all;
}

/** The part that is being drawn. */
function drafted(editor, px) {
  if (!editor.draft) return [];
  const points = [...editor.draft.points, ...(editor.draft.next ? [editor.draft.next] : [])];
  return [
    svg("path", {
      class: "draft",
      d: path(points, KINDS[editor.tool].closed),
      style: KINDS[editor.tool].closed ? "" : "fill:none",
    }),
    ...lengths(points, Boolean(editor.draft.closes), px, true),
    ...editor.draft.points.map(([x, y]) => svg("circle", { class: "handle", cx: x, cy: -y, r: 6 * px })),
  ];
}
