// The last ten minutes on the time line: `deno test --allow-read`.

import { binned } from "./timeline.js";

function equal(found, expected) {
  const [one, other] = [found, expected].map((value) => JSON.stringify(value));
  if (one !== other) throw new Error(`${one} is not ${other}`);
}

Deno.test("the last minutes are what the tracker said then, and 0 only where that was known all the time", () => {
  // 240 parts of 2.5 s.
  const line = (unix_ms, count) => ({ unix_ms, tracks: [{ id: 1 }], zones: {}, total: { count } });
  const lines = [
    line(1000, 2),
    line(2000, null),
    line(3000, 0),
    line(4000, 0),
    line(6000, 0),
    line(7000, null),
  ];
  equal(binned(lines, 600_000, 600_000).slice(0, 4), [2, 0, null, null]);
  // Of a tracker before this version.
  equal(binned([{ unix_ms: 1000, tracks: [], zones: {} }], 600_000, 600_000)[0], null);
});
