// The last ten minutes on the time line: `deno test --allow-read`.

import { between, binned, merged, TimeLine } from "./timeline.js";

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

Deno.test("nothing is known between two lines that are far apart, and between near ones people have walked", () => {
  const line = (unix_ms, x) => ({ unix_ms, tracks: [{ id: 1, x, y: 0 }], zones: { hall: { count: 1 } } });
  const lines = [line(0, 0), line(1000, 1), line(500_000, 5)];
  equal(between(lines, 250).tracks, [{ id: 1, x: 0.25, y: 0 }]);
  equal(between(lines, 1000), lines[1]);
  equal(between(lines, 2000), { unix_ms: 2000, tracks: [], zones: {}, isUnknown: true });
  equal(between(lines, 500_000), lines[2]);
  equal([between([], 5), between(lines, -5).unix_ms], [undefined, 0]);
});

Deno.test("what the tracker kept while the page was hidden fills the gap", () => {
  const line = (unix_ms, of) => ({ unix_ms, of });
  const lines = [line(1000, "page"), line(9000, "page")];
  const kept = [line(20_000, "before"), line(1010, "kept"), line(5000, "kept"), line(9500, "kept")];
  equal(merged(lines, kept), [lines[0], kept[2], lines[1], kept[3]]);
  equal(merged([], kept.slice(1)), kept.slice(1));
});

Deno.test("what the tracker kept may be newer than the frame that comes next, and a clock that was set back clears all", () => {
  const nothing = { show() {}, draw() {}, glance() {} };
  const time = Object.assign(Object.create(TimeLine.prototype), { lines: [], came: -Infinity, ...nothing });
  const kept = () => time.lines.map(({ unix_ms }) => unix_ms);
  time.add({ unix_ms: 1000 });
  time.load([{ unix_ms: 1000 }, { unix_ms: 5000 }]);
  time.add({ unix_ms: 4900 });
  time.add({ unix_ms: 5600 });
  equal(kept(), [1000, 5000, 5600]);
  time.add({ unix_ms: 800 });
  equal(kept(), [800]);
});

Deno.test("a time to come is not shown: neither one that is asked for, nor one of before the clock was set back", () => {
  const sought = [];
  const time = Object.assign(Object.create(TimeLine.prototype), {
    lines: [{ unix_ms: 5000 }],
    came: 5000,
    at: null,
    past: { asked: true },
    on: { seek: (at) => sought.push(at) },
    show() {},
    draw() {},
    glance() {},
    setPlaying() {},
  });
  time.go(6000);
  equal([time.at, sought], [null, [null]]);
  time.at = 4000;
  time.add({ unix_ms: 4500 });
  equal([time.at, sought], [4000, [null]]);
  time.add({ unix_ms: 3000 });
  equal([time.at, sought], [null, [null, null]]);
});
