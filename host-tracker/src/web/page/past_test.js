// What was known at a time of the past: `deno test`.

import { setClock } from "./clock.js";
import { Past, words, zonesAt } from "./past.js";
import { say } from "./words.js";

function equal(found, expected) {
  const [one, other] = [found, expected].map((value) => JSON.stringify(value));
  if (one !== other) throw new Error(`${one} is not ${other}`);
}

/** Calls `does` with what is asked, while `answer(path)` answers, and with the timers set. */
async function asking(answer, does) {
  const { fetch, setTimeout } = globalThis, asked = [], timers = [];
  globalThis.fetch = (path) => {
    asked.push(path);
    return Promise.resolve(answer(path)).then((found) => Response.json(found));
  };
  globalThis.setTimeout = (then) => timers.push(then);
  try {
    await does(asked, timers, () => new Promise((end) => setTimeout(end, 0)));
  } finally {
    Object.assign(globalThis, { fetch, setTimeout });
  }
}

Deno.test("what a tracker has said before a restart is not known after it", () => {
  const counts = [
    { zone: "hall", at_ms: 10, count: 0, state: "known" },
    { zone: "yard", at_ms: 20, count: 2, state: "known" },
    { zone: "hall", at_ms: 120, count: 1, state: "known" },
  ];
  const unknown = { count: null, state: "unknown" };
  const said = [
    [[0, 90], 15, { hall: { count: 0, state: "known" } }],
    [[100, 200], 110, { hall: unknown, yard: unknown }],
    [[100, 200], 130, { hall: { count: 1, state: "known" }, yard: unknown }],
  ];
  for (const [life, at, expected] of said) {
    const found = zonesAt(counts, life, at);
    if (JSON.stringify(found) !== JSON.stringify(expected)) throw new Error(JSON.stringify(found));
  }
});

Deno.test("an alarm is told by its name and the tracker's sentence", () => {
  const event = { at_ms: 1, subject: "left", track: null };
  const said = [
    [{ ...event, kind: "alarm", name: "dirty", text: "dirty: clean it: now" }, "left: clean it: now"],
    [{ ...event, kind: "alarm", text: "of a newer version" }, "left: of a newer version"],
    [{ ...event, kind: "set-aside", text: "it is set aside" }, "left: it is set aside"],
  ];
  for (const [event, expected] of said) {
    const text = words(event);
    if (text !== expected) throw new Error(`${text} instead of ${expected}`);
  }
});

Deno.test("a piece that cannot be fetched is said, and asked for again later", async () => {
  let works = false;
  const answer = () => works ? { lives: [[0, 1_000_000]] } : Promise.reject(new TypeError());
  await asking(answer, async (asked, timers, settled) => {
    const told = [];
    const past = new Past({ ready: () => told.push("ready"), failed: ({ message }) => told.push(message) });
    equal(past.lineAt(1000), null);
    await settled();
    equal([past.lineAt(1000), asked.length, told], [null, 1, [say("net.no-answer")]]);
    works = true;
    timers.shift()();
    equal([past.lineAt(1000), asked.length], [null, 2]);
    await settled();
    equal(past.lineAt(1000).noTracker, false);
  });
});

Deno.test("that no mark is kept is not said when the tracker does not answer", async () => {
  await asking(() => Promise.reject(new TypeError()), async () => {
    const past = new Past({ ready() {} });
    const error = await past.beside(1000, false, 0, 2000).catch((error) => error);
    if (!(error instanceof Error)) throw new Error(JSON.stringify(error));
  });
});

Deno.test("on a device whose clock is slow a piece is asked for once", async () => {
  // An hour before the tracker's.
  const unix_ms = Date.now() + 3_600_000;
  setClock(unix_ms);
  await asking(() => ({ lives: [[0, unix_ms]] }), async (asked, _, settled) => {
    const past = new Past({ ready() {}, failed() {} });
    const at = unix_ms - 5000;
    past.lineAt(at);
    await settled();
    equal([past.lineAt(at)?.noTracker, asked.length], [false, 1]);
  });
});

Deno.test("the answer for a range that is no longer chosen is dropped, and the other is asked for", async () => {
  const range = (path) => {
    const { from, to } = Object.fromEntries(new URLSearchParams(path.split("?")[1]));
    return to - from;
  };
  await asking((path) => ({ kept: true, bins: [range(path)] }), async (asked, _, settled) => {
    const shown = [];
    const past = new Past({ ready: () => shown.push(past.glance.bins[0]) });
    past.look(1000, 9000, 240);
    past.look(2000, 9000, 240);
    past.look(4000, 9000, 240);
    await settled();
    await settled();
    equal([shown, asked.map(range)], [[4000], [1000, 4000]]);
  });
});
