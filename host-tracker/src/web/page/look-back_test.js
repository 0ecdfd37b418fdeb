// What an address and a day stand for, and which mark is the next: `deno test`.

import { named, onDay } from "./look-back.js";
import { Past } from "./past.js";

function equal(found, expected) {
  const [one, other] = [found, expected].map((value) => JSON.stringify(value));
  if (one !== other) throw new Error(`${one} is not ${other}`);
}

Deno.test("an address names a time or none", () => {
  equal(named("#at=1700000000000"), 1_700_000_000_000);
  for (const hash of ["", "#", "#at=", "#at=0", "#at=x", "#at=17e3", "#to=1700000000000"]) {
    equal(named(hash), null);
  }
});

Deno.test("another day at the same time of day, also where the clock was changed between", () => {
  const at = new Date(2026, 2, 30, 14, 5, 6).getTime();
  equal(onDay(at, "2026-03-02"), new Date(2026, 2, 2, 14, 5, 6).getTime());
  equal(onDay(at, "2026-03-30"), at);
  // Not a 31st of February on the way.
  equal(onDay(new Date(2026, 0, 31, 8).getTime(), "2026-02-28"), new Date(2026, 1, 28, 8).getTime());
  equal(onDay(at, ""), null);
});

/** A database with marks at these times, which tells of five at once, the newest; and what it was asked. */
function kept(times) {
  const asked = [];
  globalThis.fetch = (path) => {
    const { from, to } = Object.fromEntries(new URLSearchParams(path.split("?")[1]));
    asked.push([Number(from), Number(to)]);
    const all = times.filter((at_ms) => at_ms >= Number(from) && at_ms <= Number(to)).map((at_ms) => ({
      at_ms,
    }));
    const answer = { kept: true, events: all.slice(-5), left_out: Math.max(all.length - 5, 0) };
    return Promise.resolve({ ok: true, json: () => Promise.resolve(answer) });
  };
  return asked;
}

Deno.test("the next mark is the nearest, however many there are and however far", async () => {
  const DAY = 86_400_000, newest = 40 * DAY, first = newest - 31 * DAY;
  const past = new Past({ ready: () => {} });
  const beside = async (at, ahead) => (await past.beside(at, ahead, first, newest))?.at_ms ?? null;
  const far = 20 * DAY;
  kept([far, newest - 5000, newest - 4000]);
  equal(await beside(newest, false), newest - 4000);
  equal(await beside(newest - 4000, false), newest - 5000);
  equal(await beside(newest - 5000, false), far);
  equal(await beside(far, false), null);
  equal(await beside(far, true), newest - 5000);
  equal(await beside(newest - 4000, true), null);
  // More than it tells of at once: those it leaves out are the nearest ones ahead.
  const many = Array.from({ length: 900 }, (_, number) => far + 1000 * number);
  kept(many);
  equal(await beside(far, true), far + 1000);
  equal(await beside(far + 500_500, true), far + 501_000);
  equal(await beside(far + 500_500, false), far + 500_000);
  // It is never asked for what is not there, nor for more than a month.
  for (const [from, to] of kept([])) {
    if (from < first || to > newest || to <= from) throw new Error(`${from} to ${to}`);
  }
});
