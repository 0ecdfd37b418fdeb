// The list of doors: `deno test --allow-read`.

import { doorsListed, listText } from "./doors.js";

function equal(found, expected) {
  const [one, other] = [found, expected].map((value) => JSON.stringify(value));
  if (one !== other) throw new Error(`${one} is not ${other}`);
}

Deno.test("doors stay in the list while it is not known how they are", () => {
  const site = { door: [{ name: "front" }, { name: "yard" }] };
  equal(doorsListed(site, [{ name: "front" }], false), ["front"]);
  equal(doorsListed(site, [], false), ["front", "yard"]);
  equal(doorsListed(site, [], true), []);
});

Deno.test("a door whose phase alone has changed has another row", () => {
  const text = (phase) => listText(["front"], new Map([["front", { name: "front", lock: "locked", phase }]]));
  if (text("idle") === text("asked")) throw new Error(text("asked"));
  equal(text("idle"), text("idle"));
});
