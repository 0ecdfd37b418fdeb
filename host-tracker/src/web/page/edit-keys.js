// Drawing by the keyboard alone: arrow keys move a cursor over the map, Enter sets a corner, and all of it is said.

import { setCorner } from "./edit-pointer.js";
import { KINDS, SELECT, svg } from "./shapes.js";
import { number, say, word } from "./words.js";

/** A press of an arrow key moves the cursor so far, with Shift farther, in metres. */
const STEP_M = 0.1, FAR_M = 1;
/** Two corners nearer than this are the same, in metres: a step is more. */
const SAME_M = 0.01;
const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };

/** Shown and said while the keyboard draws. */
export const KEYS = "keys.help";

const place = ([x, y]) => say("keys.place", { x: number(x, 2), y: number(y, 2) });
const onto = (step) => (at) => Math.round(Math.round(at / step) * step * 1000) / 1000;

/** Shows the cursor in the middle of the map, and says how it is moved. */
export function showCursor(editor) {
  editor.cursor = editor.view.centre.map(onto(STEP_M));
  editor.hint.textContent = say(KEYS);
  editor.say(say("keys.cursor", { kind: word("kind", editor.tool), place: place(editor.cursor) }));
  follow(editor);
}

/** Does what a key says that was pressed on the map; false if it means nothing for drawing. */
export function drawKey(editor, event) {
  if (editor.tool === SELECT || event.target !== editor.view.svg) return false;
  if (event.ctrlKey || event.metaKey || event.altKey) return false;
  const arrow = ARROWS[event.key];
  if (arrow) {
    if (!editor.cursor) return showCursor(editor), true;
    const step = event.shiftKey ? FAR_M : STEP_M;
    editor.cursor = editor.cursor.map((at, axis) => onto(STEP_M)(at + arrow[axis] * step));
    follow(editor);
    sayCursor(editor);
    return true;
  }
  if (event.key === "Backspace" && editor.draft?.points.length) {
    editor.draft.points.pop();
    follow(editor);
    const at = place(editor.cursor ?? editor.view.centre);
    editor.say(say("keys.corners", { n: editor.draft.points.length, place: at }));
    return true;
  }
  // Corners that were clicked are closed by the editor.
  if (event.key !== "Enter" && event.key !== " ") return false;
  if (!editor.cursor && editor.draft?.points.length) return false;
  if (!editor.cursor) return showCursor(editor), true;
  const { tool } = editor, corners = editor.draft?.points.length ?? 0;
  setCorner(editor, [...editor.cursor], SAME_M);
  if (editor.tool === tool) {
    if (editor.draft?.points.length > corners) {
      editor.say(say("keys.set", { n: corners + 1, place: place(editor.cursor) }) + howItEnds(editor));
    }
    follow(editor);
  }
  return true;
}

function howItEnds(editor) {
  const { least, most, closed } = KINDS[editor.tool], { length } = editor.draft.points;
  if (most) return "";
  if (closed && length === 2) return say("keys.rectangle");
  return length >= least ? say("keys.end") : "";
}

function sayCursor(editor) {
  const last = editor.draft?.points.at(-1);
  const apart = last && Math.hypot(editor.cursor[0] - last[0], editor.cursor[1] - last[1]);
  const at = place(editor.cursor);
  editor.say(last ? say("keys.from", { place: at, far: number(apart, 2) }) : at);
}

/** Draws the cursor with what it would draw, and moves the map where it leaves it. */
function follow(editor) {
  const { view, cursor } = editor;
  if (cursor) {
    if (editor.draft) editor.draft.next = cursor;
    const { width, height } = view.svg.getBoundingClientRect();
    const aside = [width, height].map((size) => (size / 2 - 40) * view.px);
    if (cursor.some((at, axis) => Math.abs(at - view.centre[axis]) > aside[axis])) {
      view.centre = [...cursor];
      view.own = true;
      view.show();
    }
  }
  editor.showTools();
  editor.showShapes();
}

/** The cursor as a cross. */
export function cursorMark(editor, px) {
  if (!editor.cursor || editor.tool === SELECT) return [];
  const [x, y] = editor.cursor, arm = 12 * px;
  return [
    svg("path", { class: "cursor", d: `M${x - arm} ${-y}H${x + arm}M${x} ${-y - arm}V${-y + arm}` }),
  ];
}
