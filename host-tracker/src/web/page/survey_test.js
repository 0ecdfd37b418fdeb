// The measured plan while it is saved: `deno test --allow-read`.

import { Survey } from "./survey.js";

function equal(found, expected) {
  const [one, other] = [found, expected].map((value) => JSON.stringify(value));
  if (one !== other) throw new Error(`${one} is not ${other}`);
}

Deno.test("a plan that was closed while it was saved does not close what was opened after it", async () => {
  const { fetch } = globalThis, closed = [];
  const one = Object.assign(Object.create(Survey.prototype), {
    open: true,
    parts: [],
    accept: {},
    fail() {},
    layer: { replaceChildren() {} },
    on: { form() {}, close: (saved) => closed.push(saved) },
  });
  globalThis.fetch = () => Promise.resolve(Response.json({ revision: 1, site: {} }));
  try {
    const saving = one.save();
    one.close(false);
    await saving;
    equal(closed, [false]);
    one.open = true;
    await one.save();
    equal(closed, [false, true]);
  } finally {
    globalThis.fetch = fetch;
  }
});
