// Where the names of zones stand on the map: `deno test`.

import { ofZones } from "./labels.js";

function equal(found, expected) {
  const [one, other] = [found, expected].map((value) => JSON.stringify(value));
  if (one !== other) throw new Error(`${one} is not ${other}`);
}

const PX = 0.01; // a metre is 100 pixels
const square = (name, left, low, side) => ({
  name,
  polygon: [[left, low], [left + side, low], [left + side, low + side], [left, low + side]],
});
const HALL = square("hall", 0, 0, 4);
const module = (name, x, y, yaw_deg = 0) => ({ name, x, y, yaw_deg });
/** Of a name: at which side, and whether in the upper half. */
const where = ({ anchor, y }) => `${anchor} ${y > 2.5 ? "high" : y < 1.5 ? "low" : "mid"}`;
const of = (site, px = PX, rem = 16) => ofZones([HALL], site, px, rem).map(where)[0];

Deno.test("a zone's name stands at the left of its top unless it would cover something", () => {
  equal(of({}), "start high");
  equal(of({ module: [module("left", 0.3, 3.8)] }), "end high");
  // Its name reaches into it, from outside of the zone.
  equal(of({ module: [module("kitchen", -0.2, 3.75)] }), "end high");
  const tops = [module("left", 0.3, 3.8), module("right", 3.7, 3.8, 180)];
  equal(of({ module: tops }), "middle high");
  equal(
    of({ entry: [{ name: "a wide entry of the hall, all of its top", line: [[0, 4], [4, 4]] }] }),
    "start low",
  );
  equal(of({ door: [{ name: "front", line: [[0.2, 3.8], [0.8, 3.8]] }] }), "end high");
  equal(of({ line: [{ name: "in", from: [0.2, 3.4], to: [0.8, 3.4] }] }), "end high");
  // One that waits in the tray stands nowhere.
  equal(of({ module: [{ ...module("left", 0.3, 3.8), placed: false }] }), "start high");
});

Deno.test("a name stays within its zone, however crooked, and off that of another", () => {
  const corner = { name: "corner", polygon: [[0, 0], [4, 0], [4, 4], [2.5, 4], [2.5, 1.5], [0, 1.5]] };
  equal(ofZones([corner], {}, PX).map(where), ["end high"]);
  const both = ofZones([HALL, { ...HALL, name: "twin" }], {}, PX).map(where);
  equal(both, ["start high", "end high"]);
});

Deno.test("people and counts move no name, and the size of letters is minded", () => {
  const site = { module: [module("left", 1.3, 3.8, 90)] };
  equal(of(site), "start high");
  equal(of(site, PX, 32), "end high");
  const [short] = ofZones([HALL], {}, PX), [long] = ofZones([{ ...HALL, name: "h".repeat(90) }], {}, PX);
  equal([short.x, short.y, short.room], [long.x, long.y, long.room]);
  equal(short.room < 4, true);
});
