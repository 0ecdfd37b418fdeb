// Names that the tracker's JSON gives to states and kinds, each written here once. The words for them are in the dictionaries.

/** Life cycle of a track. */
export const TRACK = { CONFIRMED: "confirmed", OCCLUDED: "occluded", TENTATIVE: "tentative" };

/** How a track came to be; one that is part of another has {"part-of": …}. */
export const ORIGIN = { ENTERED: "entered", UNEXPLAINED: "unexplained" };

/** How much of a zone is seen. */
export const ZONE = { KNOWN: "known", PARTLY: "partly", UNKNOWN: "unknown" };

/** State of a module. */
export const MODULE = {
  MISSING: "missing",
  FOUND: "found",
  SEARCHING: "searching",
  LEARNING: "learning",
  WATCHING: "watching",
  STORING: "storing",
};

/** What an alarm is about. */
export const ABOUT = { TRACKER: "tracker", MODULE: "module", DOOR: "door", ZONE: "zone", AREA: "area" };

/** How much an alarm takes away, the least first. */
export const SEVERITY = ["notice", "degraded", "failed"];

/** Severity of an alarm whose source does not do what it is for. */
export const FAILED = SEVERITY[2];

/** Health of a module as the page colours it, in `data-health`. */
export const HEALTH = { NONE: "none", GOOD: "good", WARN: "warn", BAD: "bad" };

/** Kind of an event of the database. */
export const EVENT = { ENTER: "enter", LEAVE: "leave", ALARM: "alarm", CLEARED: "cleared", STATE: "state" };

/** State of the connection, in `data-state`. */
export const LINK = { LIVE: "live", SILENT: "silent", LOST: "lost" };

/** What the lock of a door is to be. */
export const LOCK = { LOCKED: "locked", UNLOCKED: "unlocked", EXIT: "exit" };

/** Phases of a door that its screen treats apart; LOST is the screen's own, without an answer. */
export const PHASE = { ASKED: "asked", LOST: "lost" };

/** What the calibration is asked to do. */
export const WISH = { BEGIN: "begin", FINISH: "finish", GO_ON: "go-on", ACCEPT: "accept", STOP: "stop" };

/** Kinds of parts of a site; the keys of its lists. */
export const KIND = {
  ZONE: "zone",
  WALL: "wall",
  ENTRY: "entry",
  LINE: "line",
  MOVER: "mover",
  EXCLUDE: "exclude",
  DOOR: "door",
  MODULE: "module",
};

/** Why a module does not see a place, of those that the page treats apart; SEEN is that it does. */
export const HIDES = {
  SEEN: "seen",
  PERSON: "person",
  THING: "thing",
  WALL: "wall",
  SILENT: "silent",
  NOT_JUDGED: "not-judged",
};

/** What a wall stops; glass stops people only. */
export const BLOCKS = { PEOPLE: "people", BEAMS: "beams" };

/** What the lock of a door does when it is not known what happens there. */
export const FAIL = { SECURE: "secure", SAFE: "safe" };
