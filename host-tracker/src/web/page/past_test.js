// What was known at a time of the past: `deno test`.

import { words, zonesAt } from "./past.js";

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
