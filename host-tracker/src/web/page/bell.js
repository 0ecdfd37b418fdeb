// Alarms that nobody has seen, where somebody sees them who looks elsewhere: the page's title and icon, and a sound if wanted.

import { html } from "./shapes.js";
import { say } from "./words.js";

const KEPT = "alarm-sound", ON = "on";
const TONES_HZ = [880, 660, 880];
const TONE_S = 0.16;

/** What this browser keeps; without a place for it, nothing. */
function kept(value) {
  try {
    if (value !== undefined) localStorage.setItem(KEPT, value);
    return localStorage.getItem(KEPT);
  } catch {
    return value ?? null;
  }
}

export class Bell {
  constructor() {
    this.title = document.title;
    this.icon = document.querySelector("link[rel=icon]");
    this.plain = this.icon.href;
    this.known = null;
    this.button = html(
      "button",
      { type: "button", className: "button", id: "alarm-sound" },
      say("bell.sound"),
    );
    this.button.onclick = () => this.set(!this.on, true);
    this.set(kept() === ON, false);
    // Browsers play nothing before the visitor has touched the page.
    for (const kind of ["pointerdown", "keydown"]) {
      addEventListener(kind, () => this.on && this.context?.resume(), { passive: true });
    }
  }

  set(on, asked) {
    this.on = on;
    if (asked) kept(on ? ON : "off");
    this.button.setAttribute("aria-pressed", on);
    this.button.title = say(on ? "bell.on" : "bell.off");
    if (on) this.context ??= new AudioContext();
  }

  /** The alarms that nobody has seen; a new one rings. */
  async ring(open) {
    const fresh = this.known !== null && open.some(({ id }) => !this.known.has(id));
    this.known = new Set(open.map(({ id }) => id));
    document.title = open.length ? `(${open.length}) ${this.title}` : this.title;
    if (fresh && this.on) this.sound();
    const count = open.length;
    this.drawing ??= fetch(this.plain).then((answer) => answer.text()).catch(() => null);
    const drawing = await this.drawing;
    if (count !== this.known.size) return;
    const mark =
      `<circle cx="22" cy="10" r="10" fill="#c2362b"/><text x="22" y="15" font-family="sans-serif" ` +
      `font-size="14" font-weight="bold" text-anchor="middle" fill="#fff">${count > 9 ? "9+" : count}</text>`;
    this.icon.href = count && drawing
      ? `data:image/svg+xml,${encodeURIComponent(drawing.replace("</svg>", `${mark}</svg>`))}`
      : this.plain;
  }

  sound() {
    const { context } = this, tone = context.createOscillator(), loud = context.createGain();
    tone.connect(loud).connect(context.destination);
    const begin = context.currentTime, end = begin + TONES_HZ.length * TONE_S;
    TONES_HZ.forEach((hz, index) => tone.frequency.setValueAtTime(hz, begin + index * TONE_S));
    loud.gain.setValueAtTime(0.2, begin);
    loud.gain.linearRampToValueAtTime(0, end);
    tone.start(begin);
    tone.stop(end);
  }
}
