// Numbers that are typed for the picture under the map: `deno test`.

import { NUMBERS } from "./picture-place.js";
import { Picture } from "./picture.js";
import { say } from "./words.js";

function equal(found, expected) {
  const [one, other] = [found, expected].map((value) => JSON.stringify(value));
  if (one !== other) throw new Error(`${one} is not ${other}`);
}

/** A picture 4 m wide; `told` has what was laid, and what was refused. */
function picture() {
  const told = [];
  return Object.assign(Object.create(Picture.prototype), {
    open: true,
    place: { x: 1, y: 2, turn_deg: 0, m_per_px: 0.01, width: 400, height: 300 },
    lay: (place) => told.push(place.m_per_px),
    fail: (error) => told.push(error.message),
    told,
  });
}

Deno.test("a width that is emptied stays as it was, and one of nothing is refused in words", () => {
  const one = picture(), input = { value: "", valueAsNumber: NaN };
  one.take(input, NUMBERS.wide);
  equal([input.value, one.told], ["4", []]);
  one.take({ valueAsNumber: 0 }, NUMBERS.wide);
  equal(one.told, [say("picture.narrow")]);
  one.take({ valueAsNumber: 8 }, NUMBERS.wide);
  equal(one.told, [say("picture.narrow"), 0.02]);
});

Deno.test("a number that is being typed is taken in when the page is left", () => {
  const one = picture(), { document } = globalThis, did = [];
  const field = { blur: () => did.push("taken"), focus: () => did.push("focused") };
  one.numbers = [[{}, null], [field, null]];
  globalThis.document = { activeElement: field };
  try {
    one.leave();
    one.open = false;
    one.leave();
  } finally {
    globalThis.document = document;
  }
  equal(did, ["taken", "focused"]);
});
