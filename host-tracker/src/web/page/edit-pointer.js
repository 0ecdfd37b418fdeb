// The editor's pointer: drags and turns parts, sets corner after corner of a new one, and snaps them.

import { KIND } from "./names.js";
import { corners, GRID_M, KINDS, SELECT, setCorners } from "./shapes.js";

/** Corners nearer than this to another one take its place, in pixels. */
const SNAP_PX = 10;
/** A click this near to the first corner closes the shape, in pixels. */
const CLOSE_PX = 8;
/** With Shift sides stand at multiples of this, in degrees: thirds and halves of a right angle are among them. */
const LOCK_DEG = 15;

/** Begins a drag; returns true if the editor keeps the pointer, so that the map does not move. */
export function down(editor, place, event) {
  if (editor.tool !== SELECT) {
    editor.drag = { from: snap(editor, place) };
    return true;
  }
  const target = event.target.closest("[data-corner],[data-mid],[data-turn],[data-reader],[data-kind]");
  if (!target) {
    if (editor.chosen) editor.choose(null);
    return false;
  }
  if (target.dataset.kind) {
    editor.drag = { body: true };
    const chosen = { kind: target.dataset.kind, index: Number(target.dataset.index) };
    if (editor.chosen?.kind !== chosen.kind || editor.chosen.index !== chosen.index) editor.choose(chosen);
  }
  // With what was being typed, which is an undo of its own.
  const before = JSON.stringify(editor.site);
  const part = editor.part(editor.chosen);
  const points = corners(editor.chosen.kind, part).map((point) => [...point]);
  editor.drag = {
    before,
    part,
    points,
    from: place,
    turn: target.dataset.turn,
    reader: target.dataset.reader,
    body: Boolean(target.dataset.kind),
    corner: target.dataset.corner && Number(target.dataset.corner),
  };
  if (target.dataset.mid) {
    editor.drag.corner = Number(target.dataset.mid) + 1;
    points.splice(editor.drag.corner, 0, place);
  }
  return true;
}

/** Drags what was pressed; `moved` is false within the distance of a click. */
export function move(editor, place, moved, event) {
  if (editor.tool !== SELECT) {
    editor.cursor = null;
    if (editor.drag && moved && KINDS[editor.tool].closed && !editor.draft?.points.length) {
      editor.drag.to = snap(editor, place);
    }
    const { from, to } = editor.drag ?? {};
    if (to) editor.draft = { points: [], rectangle: [from, [to[0], from[1]], to, [from[0], to[1]]] };
    else if (editor.draft) {
      editor.draft.next = snap(editor, place, null, event?.shiftKey && editor.draft.points.at(-1));
    }
    if (!editor.draft) return;
    const shown = editor.draft.rectangle ? { points: editor.draft.rectangle, closes: true } : editor.draft;
    const draft = editor.draft;
    editor.draft = shown;
    editor.showShapes();
    editor.draft = draft;
    return;
  }
  if (!editor.drag || !moved) return;
  const { part, points, from, corner, turn, reader } = editor.drag, { kind } = editor.chosen;
  if (turn) part.yaw_deg = Math.round((Math.atan2(place[1] - part.y, place[0] - part.x) * 180) / Math.PI);
  else if (reader) part.reader = snap(editor, place, part);
  else if (corner !== undefined) {
    setCorners(
      kind,
      part,
      points.map((point, index) =>
        index === corner ? snap(editor, place, part, event?.shiftKey && beside(kind, points, corner)) : point
      ),
    );
  } else {
    const by = [0, 1].map((axis) => Math.round((place[axis] - from[axis]) / GRID_M) * GRID_M);
    setCorners(kind, part, points.map(([x, y]) => [x + by[0], y + by[1]]));
  }
  editor.on.change(editor.site);
  editor.showShapes();
}

/** Ends a drag, or sets a corner of the draft. */
export function up(editor, place, event) {
  const { drag } = editor;
  editor.drag = null;
  if (editor.tool === SELECT) return close(editor, drag);
  if (editor.draft?.rectangle) {
    const points = editor.draft.rectangle;
    return points[0][0] !== points[2][0] && points[0][1] !== points[2][1]
      ? editor.finish(points)
      : editor.use(editor.tool);
  }
  const locked = event.shiftKey && editor.draft?.points.at(-1);
  setCorner(editor, snap(editor, place, null, locked), CLOSE_PX * editor.view.px);
}

/** Ends a drag that was not meant to the end: the part stays where it is, with undo; a rectangle that was begun is dropped. */
export function cancel(editor) {
  const { drag } = editor;
  editor.drag = null;
  if (editor.tool === SELECT) return close(editor, drag);
  if (editor.draft?.rectangle) editor.draft = null;
  editor.show();
}

/** What a drag has changed can be undone, and is checked. */
function close(editor, drag) {
  if (!drag?.before || JSON.stringify(editor.site) === drag.before) return;
  editor.done.push(drag.before);
  editor.undone = [];
  editor.show();
}

/** The corner before one of a part, or after the first of an open one. */
function beside(kind, points, corner) {
  return points[corner - 1] ?? (KINDS[kind].closed ? points.at(-1) : points[corner + 1]);
}

/** Sets the next corner of the draft; corners nearer to another than `near` are that one. */
export function setCorner(editor, point, near) {
  editor.draft ??= { points: [] };
  const first = editor.draft.points[0], { least, most, closed } = KINDS[editor.tool];
  const again = (other) => other && Math.hypot(other[0] - point[0], other[1] - point[1]) < near;
  if (
    editor.draft.points.length >= least && (again(editor.draft.points.at(-1)) || (closed && again(first)))
  ) {
    return editor.finish();
  }
  if (again(editor.draft.points.at(-1))) return editor.finish(rectangle(editor) ?? []);
  editor.draft.points.push(point);
  if (editor.draft.points.length === most) editor.finish();
  else editor.show();
}

/** The rectangle whose opposite corners are both that were set of an area; null of anything else. */
export function rectangle({ draft, tool }) {
  const [from, to] = draft?.points ?? [];
  if (!KINDS[tool]?.closed || draft?.points.length !== 2) return null;
  return from[0] !== to[0] && from[1] !== to[1] ? [from, [to[0], from[1]], to, [from[0], to[1]]] : null;
}

/** At one of a few angles from `from`, as far as the grid has it. */
function lock([x, y], from) {
  const step = (LOCK_DEG * Math.PI) / 180;
  const angle = Math.round(Math.atan2(y - from[1], x - from[0]) / step) * step;
  const far = Math.round(Math.hypot(x - from[0], y - from[1]) / GRID_M) * GRID_M;
  return [from[0] + Math.cos(angle) * far, from[1] + Math.sin(angle) * far];
}

/** At an angle from `locked`, or onto a corner nearby, in line with the corner before, or onto the grid. */
function snap(editor, [x, y], except = null, locked = null) {
  if (locked) return lock([x, y], locked);
  const near = SNAP_PX * editor.view.px;
  for (const kind of Object.keys(KINDS)) {
    for (const part of editor.site[kind] ?? []) {
      if (part === except || kind === KIND.MODULE) continue;
      const corner = corners(kind, part).find(([cx, cy]) => Math.hypot(cx - x, cy - y) < near);
      if (corner) return [...corner];
    }
  }
  const last = editor.draft?.points.at(-1);
  const grid = (metres) => Math.round(metres / GRID_M) * GRID_M;
  return [
    last && Math.abs(last[0] - x) < near ? last[0] : grid(x),
    last && Math.abs(last[1] - y) < near ? last[1] : grid(y),
  ];
}
