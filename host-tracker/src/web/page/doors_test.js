// The list of doors: `deno test --allow-read`.

import { DoorPanel, doorsListed, listText } from "./doors.js";

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

Deno.test("why a reset was refused is said on the card of that door alone", async () => {
  const panel = Object.assign(Object.create(DoorPanel.prototype), {
    name: "front",
    error: { removeAttribute() {} },
  });
  const before = globalThis.fetch;
  globalThis.fetch = () => Promise.resolve(Response.json({ error: "it is open" }, { status: 409 }));
  try {
    await panel.reset("yard");
    equal(panel.error.textContent ?? "", "");
    await panel.reset("front");
    equal(panel.error.textContent, "it is open");
  } finally {
    globalThis.fetch = before;
  }
});
