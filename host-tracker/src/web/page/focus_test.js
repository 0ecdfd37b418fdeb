// The focus while elements are drawn anew: `deno test`.

import { focusHeading, keepFocus } from "./focus.js";

function equal(found, expected) {
  const [one, other] = [found, expected].map((value) => JSON.stringify(value));
  if (one !== other) throw new Error(`${one} is not ${other}`);
}

/** A layer with elements of these names, each of which can have the focus of the document. */
function layer(...names) {
  const make = (name) => ({
    dataset: { module: name },
    focus() {
      document.activeElement = this;
    },
  });
  const children = names.map(make);
  return {
    children,
    contains: (element) => children.includes(element),
    querySelectorAll: () => children,
    draw: (...names) => {
      // What is taken away has no focus.
      if (children.includes(document.activeElement)) document.activeElement = null;
      children.splice(0, children.length, ...names.map(make));
    },
  };
}

Deno.test("the focus stays on a module that is drawn anew, and comes to none that had none", () => {
  globalThis.document = { activeElement: null };
  const modules = layer("left", "right");
  const kept = (...names) => {
    keepFocus(modules, "module", () => modules.draw(...names));
    return document.activeElement?.dataset.module ?? null;
  };
  equal(kept("left", "right"), null);
  modules.children[1].focus();
  equal(kept("right", "left", "new"), "right");
  equal(document.activeElement === modules.children[0], true);
  equal(kept("left"), null);
  delete globalThis.document;
});

Deno.test("the heading of a form has the focus and is no stop of Tab", () => {
  let focused = false;
  const heading = { focus: () => focused = true };
  focusHeading({ querySelector: () => heading });
  equal([focused, heading.tabIndex], [true, -1]);
  focusHeading({ querySelector: () => null });
});
