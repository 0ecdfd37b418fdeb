// Where the picture lies: `deno test`.

import { begun, laid, NUMBERS, scaled, toPixel, toSite } from "./picture-place.js";

function near(found, expected) {
  const fine = found.length === expected.length &&
    found.every((one, index) => Math.abs(one - expected[index]) < 1e-9);
  if (!fine) throw new Error(`${JSON.stringify(found)} is not ${JSON.stringify(expected)}`);
}

const PLACE = { x: 2, y: 3, turn_deg: 90, m_per_px: 0.01, width: 400, height: 300 };

Deno.test("a pixel is at a place, and back", () => {
  // Its upper side goes up, so what is below in the picture is to the right.
  near(toSite(PLACE, [0, 0]), [2, 3]);
  near(toSite(PLACE, [100, 0]), [2, 4]);
  near(toSite(PLACE, [0, 100]), [3, 3]);
  near(toPixel(PLACE, toSite(PLACE, [123, 45])), [123, 45]);
});

Deno.test("two points on both say where it lies", () => {
  const pixels = [[10, 20], [310, 220]], places = [[-1, 5], [4, -2]];
  const found = laid(PLACE, pixels, places);
  near(toSite(found, pixels[0]), places[0]);
  near(toSite(found, pixels[1]), places[1]);
  near([found.width, found.height], [400, 300]);
  if (laid(PLACE, [[1, 1], [1, 1]], places) || laid(PLACE, pixels, [[0, 0], [0, 0]])) {
    throw new Error("of one point");
  }
});

Deno.test("two points and how far they are scale it", () => {
  const pixels = [[0, 0], [300, 400]];
  const found = scaled({ ...PLACE, turn_deg: 0 }, pixels, 2.5);
  near([found.m_per_px, found.x, found.y], [0.005, 2, 3]);
  if (scaled(PLACE, pixels, 0) || scaled(PLACE, pixels, NaN)) throw new Error("no length");
});

Deno.test("a new picture lies in the midst of the map", () => {
  const found = begun([200, 100], [0, 0, 8, 8]);
  near(toSite(found, [100, 50]), [4, 4]);
  near([found.m_per_px * 200], [6]);
});

Deno.test("a number changes what it is of, and no picture is without width", () => {
  for (const [key, value] of [["x", -1], ["y", 0], ["turn", 30], ["wide", 8]]) {
    const { of, change } = NUMBERS[key];
    near([of({ ...PLACE, ...change(value, PLACE) })], [value]);
  }
  for (const none of [0, -4]) if (NUMBERS.wide.change(none, PLACE)) throw new Error(`${none} m wide`);
});
