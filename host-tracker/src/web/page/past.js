// What the database holds: a long time at a glance, and people's paths of any moment, fetched in pieces as they are needed.

import { EVENT, TRACK, ZONE } from "./names.js";
import { alarmText } from "./alarm-words.js";
import { now } from "./clock.js";
import { ask } from "./net.js";
import { say, word } from "./words.js";

const PIECE_MS = 600_000;
const PIECES = 8; // kept at once
const RUN_UP_MS = 15_000; // for trails at the beginning of a piece
const EVENTS = 8;
/** A piece that could not be fetched is asked for again after this. */
const AGAIN_MS = 10_000;
/** Marks are looked for so near, and then as many times farther. */
const NEAR_MS = 3_600_000;
const FARTHER = 12;

export class Past {
  /** `on.ready` when something that was asked for has come, `on.failed(error)` when a piece could not be fetched. */
  constructor(on) {
    this.on = on;
    this.kept = false;
    this.asked = false;
    this.pieces = new Map();
    this.glance = null;
    this.asking = false;
  }

  /** How many people there were in the last `range` ms before a time, and what happened; asked each time, kept in `glance`. */
  async look(range, to, bins) {
    this.range = range;
    if (this.asking) return;
    this.asking = true;
    const path = `/api/overview?from=${Math.floor(to - range)}&to=${Math.ceil(to)}&bins=${bins}`;
    // Without an answer there is only what came since the page was opened.
    const answer = await ask(path).catch(() => null);
    this.asking = false;
    // Another range was chosen meanwhile: this one would be drawn as that.
    if (this.range !== range) return this.look(this.range, to, bins);
    if (!answer) return;
    this.asked = true;
    this.kept = answer.kept;
    this.glance = answer.kept ? answer : null;
    this.on.ready();
  }

  /** The piece a time lies in; null while it is on its way, or cannot be fetched. */
  piece(at) {
    const number = Math.floor(at / PIECE_MS);
    let piece = this.pieces.get(number);
    // A piece that was not over when it was asked for has grown.
    if (piece?.ready && piece.until < (number + 1) * PIECE_MS && at > piece.until) piece = null;
    if (!piece) {
      this.pieces.delete(number);
      this.pieces.set(number, piece = { ready: false });
      while (this.pieces.size > PIECES) this.pieces.delete(this.pieces.keys().next().value);
      this.fetch(number, piece);
    }
    return piece.ready ? piece : null;
  }

  async fetch(number, piece) {
    const from = number * PIECE_MS - RUN_UP_MS, to = (number + 1) * PIECE_MS;
    const asked = now();
    try {
      const answer = await ask(`/api/past?from=${Math.max(from, 0)}&to=${to}`);
      Object.assign(piece, { paths: [], counts: [], events: [], lives: [] }, answer);
    } catch (error) {
      // Until then it holds its place, so that it is not asked for at once.
      setTimeout(() => this.forget(number, piece), AGAIN_MS);
      return this.on.failed(error);
    }
    piece.until = asked - 2000;
    piece.ready = true;
    this.on.ready();
  }

  /** Nothing is known of a piece that could not be fetched: what is shown asks for it again. */
  forget(number, piece) {
    if (this.pieces.get(number) !== piece) return;
    this.pieces.delete(number);
    this.on.ready();
  }

  /** Tracks and zones at a time, in the form of a frame; null until the piece is loaded. */
  lineAt(at) {
    const piece = this.piece(at);
    if (!piece) return null;
    const tracks = piece.paths.map((path) => placeAt(path, at)).filter(Boolean);
    const life = piece.lives.findLast(([begun, ended]) => begun <= at && at <= ended + 1000);
    return { unix_ms: at, tracks, zones: life ? zonesAt(piece.counts, life, at) : {}, noTracker: !life };
  }

  /** The moments of the last `ms` before a time, for trails. */
  before(at, ms) {
    const piece = this.piece(at);
    if (!piece) return [];
    const lines = [];
    for (let then = at - ms; then <= at; then += 500) {
      lines.push({ unix_ms: then, tracks: piece.paths.map((path) => placeAt(path, then)).filter(Boolean) });
    }
    return lines;
  }

  /** What happened last before a time, the newest first. */
  eventsBefore(at) {
    const begun = Math.floor(at / PIECE_MS) * PIECE_MS;
    const own = this.piece(at)?.events ?? [], before = this.piece(begun - 1)?.events ?? [];
    // A piece begins a little earlier, for trails: what is in both is of the one before.
    const all = [
      ...before.filter(({ at_ms }) => at_ms < begun),
      ...own.filter(({ at_ms }) => at_ms >= begun),
    ];
    return all.filter(({ at_ms }) => at_ms <= at).slice(-EVENTS).reverse();
  }

  /** The mark of the time line next to a time, ahead or back, between `first` and `newest`; null if there is none. Throws what went
   * wrong if that cannot be known. */
  async beside(at, ahead, first, newest) {
    let edge = at, ms = NEAR_MS;
    while (ahead ? edge < newest : edge > first) {
      const [from, to] = ahead ? [edge, Math.min(edge + ms, newest)] : [Math.max(edge - ms, first), edge];
      const path = `/api/overview?from=${Math.floor(from)}&to=${Math.ceil(to)}&bins=1`;
      const { events = [], left_out = 0 } = await ask(path);
      // Of too many the newest are told: those next ahead are among the others.
      if (ahead && left_out && ms > 1) {
        ms /= FARTHER;
        continue;
      }
      const found = events.filter(({ at_ms }) => (ahead ? at_ms > at : at_ms < at));
      if (found.length) return ahead ? found[0] : found.at(-1);
      edge = ahead ? to : from;
      ms *= FARTHER;
    }
    return null;
  }
}

/** Zones at a time of a tracker's life; of what was said before it nothing is known. */
export function zonesAt(counts, [begun], at) {
  const zones = {};
  for (const { zone, at_ms, count, state } of counts) {
    if (at_ms > at) continue;
    zones[zone] = at_ms < begun ? { count: null, state: ZONE.UNKNOWN } : { count, state };
  }
  return zones;
}

/** A track at a time, interpolated between its stored places; null outside of its life. */
function placeAt({ track, places }, at) {
  if (!places.length || at < places[0][0] || at > places.at(-1)[0]) return null;
  let low = 0, high = places.length - 1;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (places[middle][0] < at) low = middle + 1;
    else high = middle;
  }
  const to = places[low], from = places[Math.max(low - 1, 0)];
  const whole = (to[0] - from[0]) / 1000, share = whole ? (at - from[0]) / 1000 / whole : 1;
  const [x, y] = [1, 2].map((axis) => (from[axis] + (to[axis] - from[axis]) * share) / 1000);
  const [vx, vy] = [1, 2].map((axis) => (whole ? (to[axis] - from[axis]) / 1000 / whole : 0));
  return { id: track, x, y, vx, vy, state: to[3] ? TRACK.OCCLUDED : TRACK.CONFIRMED };
}

/** An event in words. */
export function words({ kind, subject, track, name, text }) {
  const person = { track: String(track), zone: subject };
  switch (kind) {
    case EVENT.ENTER:
      return say(track == null ? "event.enter-any" : "event.enter", person);
    case EVENT.LEAVE:
      return say(track == null ? "event.leave-any" : "event.leave", person);
    case EVENT.ALARM: {
      // The text is the alarm's name and the tracker's sentence.
      const sentence = name ? text.slice(`${name}: `.length) : text;
      return say("event.told", { subject, text: alarmText({ name: name ?? "unknown", text: sentence }) });
    }
    case EVENT.CLEARED:
      return say("event.cleared", { subject, alarm: word("alarm", name ?? text) });
    case EVENT.STATE:
      return say("event.told", { subject, text: word("module", name ?? text) });
    default:
      return subject ? say("event.told", { subject, text: text || kind }) : text || kind;
  }
}
