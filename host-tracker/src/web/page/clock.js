// The tracker's clock: the time of the newest frame, and what has gone by since. The clock of a tablet may be anything.

let newest = null;

/** The tracker has said its time, in ms since 1970. */
export function setClock(unix_ms) {
  newest = { unix_ms, came_ms: performance.now() };
}

/** The tracker's time, in ms since 1970; before the first frame this device's own. */
export const now = () => newest ? newest.unix_ms + performance.now() - newest.came_ms : Date.now();
