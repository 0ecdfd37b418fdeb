// What is to be done next: how far a site has come, from nothing to people who are counted. It decides, and draws nothing.

import { MODULE } from "./names.js";
import { isPlaced } from "./shapes.js";
import { say } from "./words.js";

/** How far a site has come. */
export const STAGE = {
  ALONE: "alone", // no module is found
  FOUND: "found", // modules are found, and the site has none
  UNLEARNED: "unlearned", // one that is not placed does not know the empty room yet
  UNPLACED: "unplaced", // all that are not placed know it
  NO_ZONE: "no-zone", // placed, and nothing to count in
  READY: "ready",
};

/** The modules of a site whose place is not known. */
export const unplaced = (site) => (site.module ?? []).filter((module) => !isPlaced(module));

/** Those of them that answer, by the lines of a frame. */
export const answering = (site, lines) =>
  unplaced(site).filter(({ name }) =>
    lines.some((line) => line.name === name && line.state !== MODULE.MISSING)
  );

/** The lines of modules that answer and that the site does not have. */
export function strangers(site, lines) {
  const known = new Set([...(site.module ?? []), ...(site.floor ?? [])].map(({ name }) => name));
  return lines.filter(({ name, id, state }) => id && state !== MODULE.MISSING && !known.has(name));
}

/** Whether a module knows the empty room. */
export const hasLearned = (line) =>
  Boolean(line) && line.state === MODULE.WATCHING && line.background_age_s != null;

/** How far a site has come, by the lines of its modules in a frame. */
export function stage(site, lines) {
  const waiting = unplaced(site);
  if (waiting.length) {
    const line = ({ name }) => lines.find((one) => one.name === name);
    return waiting.every((module) => hasLearned(line(module))) ? STAGE.UNPLACED : STAGE.UNLEARNED;
  }
  if (!(site.module ?? []).length && !(site.floor ?? []).length) {
    return strangers(site, lines).length ? STAGE.FOUND : STAGE.ALONE;
  }
  return (site.zone ?? []).length ? STAGE.READY : STAGE.NO_ZONE;
}

/** What each stage asks for: a sentence, more about it, and the words of its button; null when there is nothing to be done. */
export function words(site, lines) {
  const n = strangers(site, lines).length, alone = unplaced(site).length === 1 && site.module.length === 1;
  const ask = (title, more, button) => ({
    title: say(title, { n }),
    more: say(more),
    button: say(button, { n }),
  });
  switch (stage(site, lines)) {
    case STAGE.ALONE:
      return ask("next.switch-on", "next.switch-on-more", "next.draw");
    case STAGE.FOUND:
      return ask("next.found", "next.found-more", "next.use");
    case STAGE.UNLEARNED:
      return ask("next.leave", "next.leave-more", "next.learn");
    case STAGE.UNPLACED:
      return alone
        ? ask("next.place-one", "next.place-one-more", "next.place-it")
        : ask("next.walk", "next.walk-more", "next.walk-begin");
    case STAGE.NO_ZONE:
      return ask("next.count", "next.count-more", "next.show-plan");
    default:
      return null;
  }
}
