// The last ten minutes: a strip that shows how many people there were, and a slider to look back.

import { people, svg } from "./shapes.js";

const KEEP_MS = 600_000;
const STEP_MS = 500;
const BINS = 200;

export class TimeLine {
  /** `on.seek` with a time in ms since 1970, or null for now. */
  constructor(on) {
    this.on = on;
    this.lines = [];
    this.site = {};
    this.at = null;
    this.playing = false;
    const get = (id) => document.getElementById(id);
    Object.assign(this, { slider: get("slider"), density: get("density"), clock: get("clock"), live: get("live"), play: get("play") });
    this.density.setAttribute("viewBox", `0 0 ${BINS} 100`);
    this.slider.addEventListener("input", () => {
      const back = Number(this.slider.value);
      this.seek(back >= 0 ? null : Math.max(this.newest() + back * 1000, this.lines[0]?.unix_ms ?? 0));
    });
    this.live.addEventListener("click", () => this.seek(null));
    this.play.addEventListener("click", () => this.setPlaying(!this.playing));
    let before = performance.now();
    setInterval(() => {
      const now = performance.now();
      if (this.playing && this.at !== null) this.seek(this.at + now - before, true);
      before = now;
    }, 100);
  }

  newest() { return this.lines.at(-1)?.unix_ms ?? 0; }

  /** What was there before the page was opened. */
  load(lines) {
    const first = this.lines[0]?.unix_ms ?? Infinity;
    this.lines = [...lines.filter((line) => line.unix_ms < first), ...this.lines];
    this.draw();
  }

  /** A frame as it comes; some are kept. */
  add(frame) {
    if (frame.unix_ms < this.newest()) this.lines = [];
    if (frame.unix_ms - this.newest() >= STEP_MS) {
      const { unix_ms, tracks, zones } = frame;
      this.lines.push({ unix_ms, tracks, zones });
      while (this.lines[0].unix_ms < unix_ms - KEEP_MS) this.lines.shift();
      if (this.lines.length % 4 === 0) this.draw();
    }
    this.show();
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
    this.play.setAttribute("aria-label", playing ? "Pause" : "Play from here");
    this.play.querySelector("path").setAttribute("d", playing ? "M4 3h3v10H4zM9 3h3v10H9z" : "M4 2.5v11l9-5.5Z");
  }

  show() {
    const back = this.at === null ? 0 : (this.at - this.newest()) / 1000;
    if (document.activeElement !== this.slider || this.at === null || this.playing) this.slider.value = back;
    const time = new Date(this.at ?? this.newest());
    this.clock.textContent = this.newest() ? time.toLocaleTimeString([], { hour: "2-digit", minute: "2-digit", second: "2-digit", hour12: false }) : "–";
    this.slider.setAttribute("aria-valuetext", this.at === null ? "now" : `${Math.round(-back)} seconds ago, ${this.clock.textContent}`);
    this.live.setAttribute("aria-pressed", this.at === null);
    this.play.disabled = this.at === null;
  }

  draw() {
    const counts = this.lines.map((line) => people(line, this.site).length);
    const most = Math.max(4, ...counts);
    const newest = this.newest();
    const bins = new Array(BINS).fill(null);
    this.lines.forEach((line, index) => {
      const bin = Math.floor(((line.unix_ms - newest + KEEP_MS) / KEEP_MS) * BINS - 0.001);
      if (bin >= 0 && bin < BINS) bins[bin] = Math.max(bins[bin] ?? 0, counts[index]);
    });
    let d = "";
    bins.forEach((count, bin) => { if (count) d += `M${bin} 100V${100 - (count / most) * 92}H${bin + 1}V100Z`; });
    this.density.replaceChildren(svg("path", { d }));
  }

  /** What was known at a time: the line before it, moved on towards the next. */
  lineAt(at) {
    let low = 0, high = this.lines.length - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (this.lines[middle].unix_ms <= at) low = middle; else high = middle - 1;
    }
    const [line, next] = [this.lines[low], this.lines[low + 1]];
    if (!line || !next) return line;
    const share = Math.min(Math.max((at - line.unix_ms) / (next.unix_ms - line.unix_ms), 0), 1);
    const later = new Map(next.tracks.map((track) => [track.id, track]));
    const between = (from, to) => from + (to - from) * share;
    const tracks = line.tracks.map((track) => {
      const to = later.get(track.id);
      return to ? { ...track, x: between(track.x, to.x), y: between(track.y, to.y) } : track;
    });
    return { ...line, unix_ms: at, tracks };
  }

  /** The lines of the last `ms` before a time. */
  before(at, ms) { return this.lines.filter((line) => line.unix_ms <= at && line.unix_ms > at - ms); }
}
