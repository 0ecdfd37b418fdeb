// A door that is drawn: what it is without another word, and which zone is before it: `deno test --allow-read`.

import { besideDoor, DOOR, gone, newDoor, zoneBefore } from "./door-part.js";
import { FAIL } from "./names.js";

const SITE = new URL("../../../../docs/schemas/site.json", import.meta.url);

function equal(found, expected) {
  const [one, other] = [found, expected].map((value) => JSON.stringify(value));
  if (one !== other) throw new Error(`${one} is not ${other}`);
}

const zone = (name, left, low, secure = false) => ({
  name,
  secure,
  polygon: [[left, low], [left + 2, low], [left + 2, low + 2], [left, low + 2]],
});

Deno.test("a door that is drawn is what one is whose file says nothing more", () => {
  const { Door, Fail } = JSON.parse(Deno.readTextFileSync(SITE)).$defs;
  const told = Object.entries(Door.properties).filter(([, told]) => told.default !== undefined);
  equal(told.map(([key, told]) => [key, told.default]).sort(), Object.entries(DOOR).sort());
  equal(Fail.oneOf.map((one) => one.const), Object.values(FAIL));
  const { zone: before, fail, line: none } = newDoor("front", [[0, 0], [1, 0]], []);
  equal([before, fail, none ?? null], ["", "secure", null]);
});

Deno.test("the zone before a door is the nearest, and of two that meet there the secure one", () => {
  const line = [[0.5, 2], [1.5, 2]];
  equal(zoneBefore(line, [zone("far", 5, 0, true), zone("near", 0, 0)]), "near");
  equal(zoneBefore(line, [zone("beyond", 0, 2), zone("before", 0, 0, true)]), "before");
  equal(zoneBefore(line, [zone("one", 0, 0), zone("other", 0, 2)]), "one");
  // A step of the grid further is not nearer.
  equal(zoneBefore(line, [zone("one", 0, 0), zone("other", 0, 2.1, true)]), "one");
  equal(zoneBefore([[1, 1], [1, 1]], []), "");
});

Deno.test("where cards are shown goes along with a door that is moved whole", () => {
  equal(besideDoor([[0, 0], [1, 0]]), [1.25, 0]);
  equal(gone([[0, 0], [1, 0]], [[0.5, 0.25], [1.5, 0.25]]), [0.5, 0.25]);
  equal(gone([[0, 0], [1, 0]], [[0, 0], [1.5, 0]]), null);
});
