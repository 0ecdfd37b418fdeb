// Names that the tracker's JSON gives to states and kinds, each written here once, with the words the page has for it.

/** Life cycle of a track. */
export const TRACK = { CONFIRMED: "confirmed", OCCLUDED: "occluded", TENTATIVE: "tentative" };

export const TRACK_WORDS = {
  [TRACK.CONFIRMED]: "seen",
  [TRACK.OCCLUDED]: "occluded, believed to be there",
  [TRACK.TENTATIVE]: "not sure yet",
};

/** How much of a zone is seen. */
export const ZONE = { KNOWN: "known", PARTLY: "partly", UNKNOWN: "unknown" };

export const ZONE_WORDS = {
  [ZONE.KNOWN]: "all of it seen",
  [ZONE.PARTLY]: "partly seen",
  [ZONE.UNKNOWN]: "no module looks there",
};

/** State of a module. */
export const MODULE = {
  MISSING: "missing",
  SEARCHING: "searching",
  LEARNING: "learning",
  WATCHING: "watching",
  STORING: "storing",
};

export const MODULE_WORDS = {
  [MODULE.MISSING]: "not found",
  [MODULE.SEARCHING]: "looks for its sensor",
  [MODULE.LEARNING]: "learns the empty room",
  [MODULE.WATCHING]: "watches",
  [MODULE.STORING]: "stores what it learned",
};

/** Alarms of a module that sees nothing while they last. */
export const BLINDING_ALARMS = new Set(["silent", "sensor", "covered"]);

/** Health of a module as the page colours it, in `data-health`. */
export const HEALTH = { NONE: "none", GOOD: "good", WARN: "warn", BAD: "bad" };

/** Kind of an event of the database. */
export const EVENT = { ENTER: "enter", LEAVE: "leave", ALARM: "alarm", CLEARED: "cleared", STATE: "state" };

/** State of the connection, in `data-state`. */
export const LINK = { LIVE: "live", SILENT: "silent", LOST: "lost" };

export const LINK_WORDS = {
  [LINK.LIVE]: "live",
  [LINK.SILENT]: "tracker silent",
  [LINK.LOST]: "connection lost",
};

/** Phases of a door that its screen treats apart; LOST is the screen's own, without an answer. */
export const PHASE = { ASKED: "asked", LOST: "lost" };

/** What the calibration is asked to do. */
export const WISH = { BEGIN: "begin", FINISH: "finish", GO_ON: "go-on", ACCEPT: "accept", STOP: "stop" };

/** Kinds of parts of a site; the keys of its lists. */
export const KIND = { ZONE: "zone", WALL: "wall", ENTRY: "entry", MOVER: "mover", MODULE: "module" };

/** What a wall stops; glass stops people only. */
export const BLOCKS = { PEOPLE: "people", BEAMS: "beams" };
