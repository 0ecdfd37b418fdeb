// The time line: how many people there were, what went wrong, and a slider to look back. The last ten minutes come as they
// happen; what was before comes from the database, if there is one.

import { EVENT } from "./names.js";
import { html, svg } from "./shapes.js";
import { say, time } from "./words.js";

const KEEP_MS = 600_000;
const STEP_MS = 500;
const BINS = 240;
const GLANCE_MS = 10_000; // between two looks into the database
const SPEEDS = [1, 5, 20, 60];
/** How far back: numbers of each unit, and in ms. */
const RANGES = {
  minutes: [[10, KEEP_MS]],
  hours: [[1, 3_600_000], [6, 21_600_000], [24, 86_400_000]],
  days: [[7, 604_800_000], [31, 2_678_400_000]],
};

/** What was known between two lines that are farther apart, in ms, is not: a hidden page gets no frames. */
const GAP_MS = 3000;

/** `lines` with those of `more` that are of other times, oldest first; of `more`, in the order told, what was before the clock was last
 * set back is left out. */
export function merged(lines, more) {
  const steps = new Set(lines.map(({ unix_ms }) => Math.round(unix_ms / STEP_MS)));
  const begin = more.findLastIndex(({ unix_ms }, index) => unix_ms < more[index - 1]?.unix_ms);
  const others = more.slice(Math.max(begin, 0)).filter(({ unix_ms }) =>
    !steps.has(Math.round(unix_ms / STEP_MS))
  );
  return [...lines, ...others].sort((one, other) => one.unix_ms - other.unix_ms);
}

/** What was known at a time: the last of some lines before it, moved on towards the next; nothing in a gap. */
export function between(lines, at) {
  let low = 0, high = lines.length - 1;
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (lines[middle].unix_ms <= at) low = middle;
    else high = middle - 1;
  }
  const [line, next] = [lines[low], lines[low + 1]];
  if (!line || !next || at <= line.unix_ms) return line;
  if (next.unix_ms - line.unix_ms > GAP_MS) {
    return { unix_ms: at, tracks: [], zones: {}, isUnknown: true };
  }
  const share = Math.min((at - line.unix_ms) / (next.unix_ms - line.unix_ms), 1);
  const later = new Map(next.tracks.map((track) => [track.id, track]));
  const moved = (from, to) => from + (to - from) * share;
  const tracks = line.tracks.map((track) => {
    const to = later.get(track.id);
    return to ? { ...track, x: moved(track.x, to.x), y: moved(track.y, to.y) } : track;
  });
  return { ...line, unix_ms: at, tracks };
}

/** The most people at once in each part of the time before `newest`, as the tracker said their number then; 0 only where that was
 * known all the time, null where nothing was. */
export function binned(lines, newest, range) {
  const bins = new Array(BINS).fill(null), open = new Set();
  for (const { unix_ms, total } of lines) {
    const bin = Math.floor(((unix_ms - newest + range) / range) * BINS - 0.001);
    if (bin < 0 || bin >= BINS) continue;
    const count = total?.count ?? null;
    if (count === null) open.add(bin);
    else bins[bin] = Math.max(bins[bin] ?? 0, count);
  }
  return bins.map((most, bin) => most === 0 && open.has(bin) ? null : most);
}

const get = (id) => document.getElementById(id);
const clock = (ms, parts) => time(ms, { hour: "2-digit", minute: "2-digit", ...parts });

export class TimeLine {
  /** `on.seek` with a time in ms since 1970, or null for now; `past` is what the database holds. */
  constructor(past, on) {
    Object.assign(this, {
      past,
      on,
      lines: [],
      at: null,
      wanted: null,
      playing: false,
      speed: 1,
      range: KEEP_MS,
      glanced: -Infinity,
      came: -Infinity,
    });
    for (const id of ["slider", "density", "clock", "live", "play", "speed", "range", "ticks"]) {
      this[`${id}_`] = get(id);
    }
    this.density_.setAttribute("viewBox", `0 0 ${BINS} 100`);
    this.slider_.addEventListener("input", () => {
      const back = Number(this.slider_.value);
      this.seek(back >= 0 ? null : Math.max(this.newest() + back * 1000, this.first()));
    });
    this.live_.addEventListener("click", () => this.seek(null));
    this.play_.addEventListener("click", () => this.setPlaying(!this.playing));
    this.speed_.addEventListener("click", () => {
      this.speed = SPEEDS[(SPEEDS.indexOf(this.speed) + 1) % SPEEDS.length];
      this.speed_.textContent = `${this.speed}×`;
      this.speed_.setAttribute("aria-label", say("time.speed", { n: this.speed }));
    });
    this.range_.addEventListener("change", () => this.setRange(Number(this.range_.value)));
    this.speed_.setAttribute("aria-label", say("time.speed", { n: this.speed }));
    this.range_.replaceChildren(
      ...Object.entries(RANGES).flatMap(([unit, counts]) =>
        counts.map(([n, ms]) =>
          html("option", { value: ms, disabled: ms > KEEP_MS }, say(`time.${unit}`, { n }))
        )
      ),
    );
    this.setRange(KEEP_MS);
    let before = performance.now();
    setInterval(() => {
      const now = performance.now();
      if (this.playing && this.at !== null) this.seek(this.at + (now - before) * this.speed, true);
      before = now;
    }, 100);
  }

  newest() {
    return this.lines.at(-1)?.unix_ms ?? 0;
  }

  /** The first time that can be shown. */
  first() {
    return this.past.kept ? Math.max(this.newest() - this.range, 0) : this.lines[0]?.unix_ms ?? 0;
  }

  /** As far back as can be shown. */
  longest() {
    return Number([...this.range_.options].at(-1).value);
  }

  setRange(ms) {
    this.range = ms;
    this.slider_.min = -ms / 1000;
    this.slider_.step = Math.max(ms / 1000 / 1200, 0.5);
    this.glanced = -Infinity;
    this.past.glance = null;
    this.glance();
    if (this.at !== null) this.seek(Math.max(this.at, this.newest() - ms));
    this.draw();
    this.show();
  }

  /** Looks into the database, now and then. */
  glance() {
    if (!this.newest() || performance.now() - this.glanced < GLANCE_MS) return;
    this.glanced = performance.now();
    this.past.look(this.range, this.newest(), BINS);
  }

  /** The database has answered. */
  ready() {
    for (const option of this.range_.options) {
      option.disabled = !this.past.kept && Number(option.value) > KEEP_MS;
    }
    this.range_.title = this.past.kept ? "" : say("time.db");
    this.draw();
    if (this.wanted !== null) this.go(this.wanted);
  }

  /** What was there before the page was opened, and while it was hidden. */
  load(lines) {
    this.lines = merged(this.lines, lines);
    this.draw();
  }

  /** A frame as it comes; some are kept. */
  add(frame) {
    // The clock was set back. What the tracker keeps may come before the frame of that time.
    if (frame.unix_ms < this.came) {
      this.lines = [];
      // A time that is shown may be one to come now, of which nothing is known.
      if (this.at !== null && this.at > frame.unix_ms) this.seek(null);
    }
    this.came = frame.unix_ms;
    if (frame.unix_ms - this.newest() >= STEP_MS) {
      const { unix_ms, tracks, zones, total } = frame;
      this.lines.push({ unix_ms, tracks, zones, total });
      while (this.lines[0].unix_ms < unix_ms - KEEP_MS) this.lines.shift();
      this.glance();
      if (this.lines.length % 4 === 0) this.draw();
    }
    this.show();
  }

  /** Shows a time, however long ago: in the shortest range that holds it, as soon as it is known what the database holds. */
  go(at) {
    this.wanted = this.past.asked ? null : at;
    if (!this.past.asked) return;
    // What is to come is not known: it would be shown as what is now.
    if (at >= this.newest()) return this.seek(null);
    const ranges = [...this.range_.options].filter((option) => !option.disabled).map((option) =>
      Number(option.value)
    );
    const range = ranges.find((ms) => at > this.newest() - ms) ?? ranges.at(-1);
    if (range > this.range) {
      this.range_.value = range;
      this.setRange(range);
    }
    this.seek(Math.max(at, this.first()));
  }

  seek(at, playing = false) {
    if (at !== null && playing && at >= this.newest() - STEP_MS) at = null;
    this.at = at;
    if (at === null || !playing) this.setPlaying(playing && at !== null);
    this.show();
    this.on.seek(at);
  }

  setPlaying(playing) {
    this.playing = playing;
    this.play_.setAttribute("aria-label", say(playing ? "time.pause" : "time.play"));
    this.play_.querySelector("path").setAttribute(
      "d",
      playing ? "M4 3h3v10H4zM9 3h3v10H9z" : "M4 2.5v11l9-5.5Z",
    );
  }

  show() {
    const back = this.at === null ? 0 : (this.at - this.newest()) / 1000;
    if (document.activeElement !== this.slider_ || this.at === null || this.playing) {
      this.slider_.value = back;
    }
    const shown = this.at ?? this.newest();
    const day = this.range > 86_400_000 && this.at !== null ? { weekday: "short" } : {};
    this.clock_.textContent = shown ? clock(shown, { second: "2-digit", ...day }) : "–";
    this.slider_.setAttribute(
      "aria-valuetext",
      this.at === null
        ? say("age.now")
        : say("time.value", { s: Math.round(-back), clock: this.clock_.textContent }),
    );
    this.live_.setAttribute("aria-pressed", this.at === null);
    this.play_.disabled = this.speed_.disabled = this.at === null;
  }

  /** The most people in each part of the range, null where nothing is known. */
  bins() {
    if (this.range > KEEP_MS && this.past.glance) return this.past.glance.bins;
    return binned(this.lines, this.newest(), this.range);
  }

  draw() {
    const bins = this.bins(), newest = this.newest(), most = Math.max(4, ...bins);
    let counts = "", gaps = "";
    bins.forEach((count, bin) => {
      if (count) counts += `M${bin} 100V${100 - (count / most) * 88}H${bin + 1}V100Z`;
      else if (count === null) gaps += `M${bin} 100V94H${bin + 1}V100Z`;
    });
    const marks = { alarm: "", other: "" };
    for (const { at_ms, kind } of this.past.glance?.events ?? []) {
      const x = ((at_ms - newest + this.range) / this.range) * BINS;
      if (x >= 0) {
        marks[kind === EVENT.ALARM ? "alarm" : "other"] += `M${x.toFixed(2)} 0V${
          kind === EVENT.ALARM ? 100 : 26
        }`;
      }
    }
    this.density_.replaceChildren(
      svg("path", { class: "gaps", d: gaps }),
      svg("path", { class: "counts", d: counts }),
      svg("path", { class: "mark", d: marks.other }),
      svg("path", { class: "mark alarms", d: marks.alarm }),
    );
    const [left, middle] = this.ticks_.children;
    const day = this.range > 86_400_000 ? { weekday: "short" } : {};
    const ago = (
      ms,
    ) => (!newest
      ? ""
      : this.range === KEEP_MS
      ? say("time.min-ago", { n: ms / 60_000 })
      : clock(newest - ms, day));
    left.textContent = ago(this.range);
    middle.textContent = ago(this.range / 2);
  }

  /** Whether a time is older than what came since the page was opened. */
  isOld(at) {
    return this.past.kept && at < (this.lines[0]?.unix_ms ?? Infinity);
  }

  /** What was known at a time; null while that is on its way. */
  lineAt(at) {
    if (this.isOld(at)) return this.past.lineAt(at);
    return between(this.lines, at);
  }

  /** The lines of the last `ms` before a time. */
  before(at, ms) {
    if (this.isOld(at)) return this.past.before(at, ms);
    return this.lines.filter((line) => line.unix_ms <= at && line.unix_ms > at - ms);
  }
}
