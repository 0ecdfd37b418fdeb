// Walkers between two frames: drawn about one frame late, so that there is always a place to walk to, and moved at every repaint.
//
//   frames      a ──────── b ──────── c       as far apart as they come
//   shown                 ──▸ at              moves on with the time, a little faster or slower so that it never waits

const KEEP = 12;
const WINDOW = 50; // frames by which lateness is judged: five seconds
const LATE_MS = 500; // later than this is a halt
const BRAKE_MS = 25; // nearer to the newest frame than this it slows down, rather than stop
const SLEW_MS = 300;

export class Motion {
  constructor() {
    this.frames = [];
    this.elements = new Map();
    this.at = null;
    this.drawn = null;
    this.came = [];
    this.late = { offset: 0, delay: 0 };
    this.still = matchMedia("(prefers-reduced-motion: reduce)");
  }

  /** The places of a time, in ms of any steady clock: [[id, element, x, y], …]. Without a time, or if the visitor wants no
   * motion, they are shown at once. */
  show(ms, places) {
    this.elements = new Map(places.map(([id, element]) => [id, element]));
    const frame = { ms, places: new Map(places.map(([id, , x, y]) => [id, [x, y]])) };
    const newest = this.frames.at(-1);
    if (ms === null || this.still.matches) {
      this.frames = [];
      this.at = null;
      for (const [id, element] of this.elements) put(element, ...frame.places.get(id));
      return;
    }
    const goesOn = newest && ms >= newest.ms && ms - newest.ms < 2 * LATE_MS;
    if (!goesOn) {
      this.frames = [];
      this.came = [];
    }
    if (goesOn && ms === newest.ms) this.frames.pop();
    else this.judge(ms, goesOn ? newest.ms : ms);
    this.frames.push(frame);
    if (this.frames.length > KEEP) this.frames.shift();
    if (!this.frames.some((known) => known.ms <= this.at)) this.at = this.frames[0].ms;
    this.draw();
    this.wanted ??= requestAnimationFrame((now) => this.step(now));
  }

  /** How late frames come by the clock of the fastest, and so how far behind it is to be drawn that there is always one ahead. */
  judge(ms, before) {
    this.came.push({ offset: performance.now() - ms, gap: ms - before });
    if (this.came.length > WINDOW) this.came.shift();
    const offset = Math.min(...this.came.map((frame) => frame.offset));
    const delay = Math.max(...this.came.map((frame) => frame.offset - offset + frame.gap));
    this.late = { offset, delay: Math.min(delay, LATE_MS) };
  }

  step(now) {
    this.wanted = null;
    const newest = this.frames.at(-1);
    if (!newest) {
      this.drawn = null;
      return;
    }
    const passed = this.drawn === null ? 0 : Math.min(now - this.drawn, LATE_MS);
    this.drawn = now;
    const off = now - this.late.offset - this.late.delay - this.at;
    if (off > LATE_MS) this.at += off;
    const pace = Math.min(Math.max(1 + off / SLEW_MS, 0.5), 1.5);
    const left = newest.ms - this.at, brake = Math.min(Math.max(left, 0) / BRAKE_MS, 1);
    this.at = Math.min(this.at + passed * pace * brake, newest.ms);
    this.draw();
    // Nothing more has come: the next frame begins it again.
    if (left > 0.01) this.wanted = requestAnimationFrame((next) => this.step(next));
    else this.drawn = null;
  }

  draw() {
    for (const [id, element] of this.elements) {
      let from = null, to = null;
      for (const { ms, places } of this.frames) {
        const place = places.get(id);
        if (!place) continue;
        if (ms <= this.at || !from) from = { ms, place };
        if (ms >= this.at) {
          to = { ms, place };
          break;
        }
      }
      if (!from) continue;
      to ??= from;
      const share = to.ms > from.ms ? Math.min(Math.max((this.at - from.ms) / (to.ms - from.ms), 0), 1) : 0;
      put(element, ...from.place.map((value, axis) => value + (to.place[axis] - value) * share));
    }
  }
}

function put(element, x, y) {
  element.style.transform = `translate(${x.toFixed(4)}px, ${(-y).toFixed(4)}px)`;
}
