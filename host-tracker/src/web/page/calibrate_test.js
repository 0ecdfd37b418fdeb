// The calibration view before it begins, after it has ended elsewhere, and without an answer: `deno test --allow-read`.

import { Calibration } from "./calibrate.js";
import { say } from "./words.js";

function equal(found, expected) {
  const [one, other] = [found, expected].map((value) => JSON.stringify(value));
  if (one !== other) throw new Error(`${one} is not ${other}`);
}

const walk = () => {
  const closed = [];
  return Object.assign(Object.create(Calibration.prototype), {
    open: true,
    begun: false,
    text: "",
    advice: { removeAttribute() {} },
    closed,
    close: (...how) => closed.push(how),
  });
};
const begins = { active: true, advice_is: null, found: null, refused_is: null };
const none = { ...begins, active: false };

Deno.test("a walk that begins has no advice yet", () => {
  const one = walk();
  one.show(begins, false);
  equal([one.begun, one.text, one.closed], [true, "", []]);
});

Deno.test("a walk that ends elsewhere says so and closes, and one that has not begun waits", () => {
  const one = walk();
  one.show(none, false);
  equal(one.closed, []);
  one.show(none, true);
  equal(one.closed, [[false, say("walk.ended")]]);
});

Deno.test("after an error the same status is told again", async () => {
  const one = Object.assign(walk(), { text: "told" }), { fetch } = globalThis;
  globalThis.fetch = () => Promise.reject(new TypeError());
  try {
    await one.look();
  } finally {
    globalThis.fetch = fetch;
  }
  equal([one.text, one.advice.textContent], ["", say("net.no-answer")]);
});

Deno.test("a walk that has closed does not close what was opened after it", () => {
  const one = walk();
  delete one.close;
  Object.assign(one, {
    layer: { replaceChildren() {} },
    on: { form: (form) => one.closed.push(form), close: (...how) => one.closed.push(how) },
  });
  one.close(false, "ended");
  one.close(true);
  equal(one.closed, [null, [false, "ended"]]);
});

Deno.test("a walk is left at once while the tracker is silent, which is told afterwards", async () => {
  const one = walk(), { fetch } = globalThis, told = [];
  one.on = { failed: (error) => told.push(error.message) };
  let refuse = null;
  globalThis.fetch = () => new Promise((_, no) => refuse = no);
  try {
    const left = one.leave();
    equal([one.closed, told], [[[false]], []]);
    refuse(new TypeError());
    await left;
  } finally {
    globalThis.fetch = fetch;
  }
  equal(told, [say("net.change-not-known")]);
});

Deno.test("an answer that comes when the next walk has begun does not end that one", async () => {
  const one = Object.assign(walk(), { begun: true, timer: 1 }), { fetch } = globalThis;
  let give = null;
  globalThis.fetch = () => new Promise((yes) => give = yes);
  try {
    const asked = one.look();
    one.timer = 2;
    give(Response.json(none));
    await asked;
  } finally {
    globalThis.fetch = fetch;
  }
  equal(one.closed, []);
});
