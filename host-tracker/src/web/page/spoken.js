// The number of people, said to screen readers when it changes, and not too often.

import { total } from "./shapes.js";
import { say } from "./words.js";

const SPEAK_MS = 5000;

let spoken = { at: 0, total: null };

/** Says how many people a frame has. */
export function speak(frame, site) {
  const now = performance.now(), found = total(frame, site, frame.modules).count;
  // With nothing to count in, nobody is not 0 people.
  const count = (site.zone ?? []).length ? found : found || null;
  if (count === spoken.total || now - spoken.at < SPEAK_MS) return;
  spoken = { at: now, total: count };
  document.getElementById("spoken").textContent = count === null
    ? say("spoken.unknown")
    : say("spoken.people", { n: count });
}
