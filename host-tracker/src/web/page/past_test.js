// What was known at a time of the past: `deno test`.

import { zonesAt } from "./past.js";

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
