// Drags that do not end as they were meant: `deno test --allow-read`.

import { cancel, down, move } from "./edit-pointer.js";
import { SELECT } from "./shapes.js";
import { View } from "./view.js";

function equal(found, expected) {
  const [one, other] = [found, expected].map((value) => JSON.stringify(value));
  if (one !== other) throw new Error(`${one} is not ${other}`);
}

const editor = (more) => ({
  site: {},
  done: [],
  undone: ["redo"],
  draft: null,
  drag: null,
  shown: 0,
  view: { px: 0.01 },
  on: { change() {} },
  part(chosen) {
    return chosen && this.site[chosen.kind]?.[chosen.index];
  },
  showShapes() {},
  show() {
    this.shown += 1;
  },
  ...more,
});

Deno.test("a rectangle that was begun is dropped when the pointer is lost", () => {
  const one = editor({ tool: "zone" });
  down(one, [0, 0]);
  move(one, [2, 1], true);
  equal(one.draft.rectangle.length, 4);
  cancel(one);
  equal([one.draft, one.drag, one.site, one.shown], [null, null, {}, 1]);
});

Deno.test("corners that are set stay when the pointer is lost", () => {
  const one = editor({ tool: "wall", draft: { points: [[0, 0]] } });
  down(one, [1, 0]);
  cancel(one);
  equal(one.draft.points, [[0, 0]]);
});

Deno.test("a part that was dragged when the pointer is lost has an undo", () => {
  const chosen = { kind: "wall", index: 0 };
  const one = editor({ tool: SELECT, chosen, site: { wall: [{ points: [[0, 0], [1, 0]] }] } });
  const before = JSON.stringify(one.site);
  const target = { closest: () => ({ dataset: { kind: "wall", index: "0" } }) };
  down(one, [0, 0], { target });
  move(one, [0, 1], true);
  cancel(one);
  equal([one.site.wall[0].points[0], one.done, one.undone, one.shown], [[0, 1], [before], [], 1]);
  cancel(one);
  equal([one.done.length, one.shown], [1, 1]);
});

Deno.test("a second finger and a lost pointer end what the first has begun, and are no click", () => {
  const told = [];
  const view = (on) =>
    Object.assign(Object.create(View.prototype), {
      svg: { setPointerCapture() {}, classList: { remove() {} } },
      pointers: new Map(),
      place: () => [0, 0],
      on: {
        ...on,
        up: () => told.push("up"),
        cancel: () => told.push("cancel"),
        click: () => told.push("click"),
      },
    });
  const finger = (pointerId, type) => ({ pointerId, type, button: 0, clientX: 0, clientY: 0 });
  const one = view({ down: () => true });
  one.down(finger(1));
  one.down(finger(2));
  equal(told.splice(0), ["cancel"]);
  one.down(finger(3));
  equal(told.splice(0), []);
  const other = view({ down: () => true });
  other.down(finger(1));
  other.up(finger(1, "pointercancel"));
  equal(told.splice(0), ["cancel"]);
  other.down(finger(1));
  other.up(finger(1, "pointerup"));
  equal(told.splice(0), ["up"]);
  // A tap of two fingers, and a third one beside one that stays.
  const tapped = view({});
  for (const id of [1, 2]) tapped.down(finger(id));
  tapped.up(finger(1, "pointerup"));
  tapped.down(finger(3));
  for (const id of [3, 2]) tapped.up(finger(id, "pointerup"));
  equal(told.splice(0), []);
  tapped.down(finger(1));
  tapped.up(finger(1, "pointerup"));
  equal(told.splice(0), ["click"]);
});
