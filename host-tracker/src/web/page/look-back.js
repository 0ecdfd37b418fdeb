// Looking back by more than the slider: to a day, from mark to mark of the time line, and by an address that names the time.

import { words } from "./past.js";
import { dateTime, say } from "./words.js";

/** Browsers refuse an address that changes much more often. */
const WRITE_MS = 300;

const get = (id) => document.getElementById(id);
const two = (number) => String(number).padStart(2, "0");

/** A day as `input` has it, in the visitor's own time. */
function dayOf(ms) {
  const day = new Date(ms);
  return `${day.getFullYear()}-${two(day.getMonth() + 1)}-${two(day.getDate())}`;
}

/** The same time of day on another day, in ms since 1970; null if that is no day. */
export function onDay(ms, day) {
  const [, year, month, date] = /^(\d{4})-(\d\d)-(\d\d)$/.exec(day) ?? [];
  if (!year) return null;
  const there = new Date(ms);
  there.setFullYear(Number(year), Number(month) - 1, Number(date));
  return there.getTime();
}

/** The time that an address names: #at=1700000000000, ms since 1970. */
export const named = (hash) => Number(/^#at=(\d+)$/.exec(hash)?.[1]) || null;

export class LookBack {
  /** `time` is the time line, `past` what the database holds; `tell` says what was found. */
  constructor(time, past, tell) {
    Object.assign(this, { time, past, tell, looking: false });
    this.day = get("day");
    this.before = get("event-before");
    this.after = get("event-after");
    this.before.onclick = () => this.step(false);
    this.after.onclick = () => this.step(true);
    this.day.onchange = () => this.toDay();
  }

  /** Shows where one is, and what can be done from there. */
  show() {
    const { time, past } = this, newest = time.newest(), at = time.at ?? newest;
    this.before.disabled = !past.kept;
    this.after.disabled = !past.kept || time.at === null;
    this.day.disabled = !past.kept;
    for (const one of [this.before, this.after, this.day]) one.title = past.kept ? "" : say("time.db");
    if (!newest || document.activeElement === this.day) return;
    this.day.min = dayOf(newest - time.longest());
    this.day.max = dayOf(newest);
    this.day.value = dayOf(at);
  }

  /** The address names the time that is shown, once it stays. */
  remember(at) {
    clearTimeout(this.writing);
    const write = () => {
      const hash = at === null ? "" : `#at=${Math.round(at)}`;
      if (location.hash !== hash) history.replaceState(null, "", location.pathname + hash);
    };
    if (at === null) write();
    else this.writing = setTimeout(write, WRITE_MS);
  }

  toDay() {
    // A year that is being typed is a year of long ago.
    if (!this.day.value || !this.day.validity.valid) return;
    const at = onDay(this.time.at ?? this.time.newest(), this.day.value);
    if (at === null) return;
    if (at >= this.time.newest()) this.time.seek(null);
    else this.time.go(at);
  }

  /** To the next mark of the time line, or the one before; says what it is. */
  async step(ahead) {
    if (this.looking) return;
    this.looking = true;
    const { time } = this, newest = time.newest();
    try {
      const event = await this.past.beside(time.at ?? newest, ahead, newest - time.longest(), newest);
      if (event) {
        time.go(event.at_ms);
        this.tell(say("time.happened", { time: dateTime(event.at_ms), event: words(event) }));
      } else this.tell(say(ahead ? "time.none-after" : "time.none-before"));
    } catch (error) {
      this.tell(error.message);
    } finally {
      this.looking = false;
    }
  }
}
