// What kehai-tracker sends and takes, version 1.0.0: made by `kehai-tracker schema typescript`.

/** What an alarm is about, without its name. */
export type About = "tracker" | "module" | "door" | "zone" | "area";

/** What is to be absorbed. */
export interface Absorb {
  /** Its direction, degrees from the module's front, counter-clockwise; without it, the only thing there is. */
  bearing?: number | null;
}

/** What was absorbed. */
export interface Absorbed {
  /** The background's version after that. */
  background_version: number;
  /** How many beams see the new background. */
  beams: number;
  /** Its middle, degrees from the module's front, counter-clockwise. */
  bearing_deg: number;
  /** How far it is, m. */
  range_m: number;
}

/** Who has seen an alarm, and when. */
export interface Acknowledged {
  /** ms since 1970. */
  at_ms: number;
  /** Who. */
  by: string;
}

/** What an alarm is decided on. */
export interface AlarmCondition {
  /** For how long the condition has been other than the alarm, s. */
  for_s: number;
  /** Whether its condition holds now. */
  holds: boolean;
  /** Whether it rings. */
  is_on: boolean;
  /** The alarm. */
  kind: AlarmKind;
  /** What is measured for it, if that is a number; null while it is not known. */
  measured: Measured | null;
  /** For how long it must hold until the alarm rings, s. */
  raise_s: number;
}

/** What is wrong. */
export type AlarmKind =
  | "silent"
  | "sensor"
  | "line"
  | "covered"
  | "slow"
  | "clock-off"
  | "dirty"
  | "store"
  | "background"
  | "suspect"
  | "watchdog"
  | "moved"
  | "blind"
  | "same-name"
  | "panels"
  | "floor-size"
  | "database"
  | "raw-scans"
  | "recording"
  | "tracks-out"
  | "thread"
  | "keys"
  | "no-key"
  | "crowded"
  | "unknown";

/** An alarm of a device or of the tracker, as it is written. */
export interface AlarmLine {
  /** What is wrong, for programs. When a device raises which: tracking/src/session/health/alarms.rs. */
  name: AlarmKind;
  /** How much that takes away. */
  severity: Severity;
  /** What it is and what to do, in words. */
  text: string;
}

/** Why there is an alarm; by its name in JSON. No two of both kinds have the same. */
export type AlarmName = DoorAlarm | AlarmKind;

/** What is told to the webhook. */
export interface AlarmTold {
  /** The alarm after that. */
  alarm: ListedAlarm;
  /** What became of it. */
  event: Became;
  /** The site's name. */
  site: string;
}

/** What was acknowledged. */
export interface AlarmsAcknowledged {
  /** Those that were not acknowledged before. */
  acknowledged: ListedAlarm[];
}

/** The alarms that stand, and those that ended within the last day. */
export interface AlarmsListed {
  /** Those that ended within the last day, the newest first. */
  ended: ListedAlarm[];
  /** Changes that a listener missed, as it was too slow. */
  missed: number;
  /** Those that stand, the oldest first. */
  standing: ListedAlarm[];
  /** This machine's time. */
  unix_ms: number;
  /** What has been told to the webhook. */
  webhook: Told;
}

/** Alarms that a user has seen. */
export interface AlarmsSeen {
  /** Their numbers. */
  ids: number[];
}

/** What became of an alarm. */
export type Became = "raised" | "acknowledged" | "ended";

/** What a wall stops. */
export type Blocks = "people" | "beams";

/** What the walker is to do. */
export type CalibrationAdvice =
  | { is: "single" }
  | { is: "alone"; module: string }
  | { is: "begin"; module: string }
  | { is: "reach"; module: string }
  | { is: "reach-floor"; module: string }
  | { is: "together"; one: string; other: string; place: CalibrationPlace | null }
  | { floor: string; is: "cross-floor"; module: string }
  | { is: "enough" };

/** What the browser wants. */
export type CalibrationDo = "begin" | "finish" | "go-on" | "accept" | "stop";

/** What was found. */
export interface CalibrationFound {
  /** Which modules see what from there. */
  coverage: Coverage;
  /** Each module's place. */
  modules: CalibrationModule[];
  /** How good it is, in a sentence. */
  quality: string;
  /** By which figures; null of a single module, whose place is by definition. */
  quality_is: CalibrationQuality | null;
}

/** How good the whole is. */
export type CalibrationGrade = "very-good" | "good" | "fair" | "poor";

/** Which way up a module hangs, as the walk says. */
export interface CalibrationHang {
  /** How far apart it and another module see the walker so, m; null: the walk does not say. */
  right_m: number | null;
  /** Whether that is not as the site had it. */
  turned: boolean;
  /** And the other way up, m. */
  wrong_m: number | null;
}

/** A module's place. */
export interface CalibrationModule {
  /** How far its clock is behind, ms. */
  clock_ms: number;
  /** Within which its clock is with 95 %, ms; absent of a floor, which has none. */
  clock_within_ms?: number | null;
  /** How clearly the walk says so; absent of the module that is held fixed, and of a floor. */
  hang?: CalibrationHang | null;
  /** How far that is from where the site had it, m; absent if it had no place. */
  moved_m?: number | null;
  /** Its name. */
  name: string;
  /** How far what it saw is from the walk, m: median. */
  residual_m: number;
  /** All that in words. */
  text: string;
  /** Whether it hangs head down; of a floor false. */
  upside_down: boolean;
  /** The same for its direction, degrees. */
  within_deg: number;
  /** Within which it is with 95 %, m. */
  within_m: number;
  /** Its place, m, and direction, degrees. */
  x: number;
  /** See x. */
  y: number;
  /** See x. */
  yaw_deg: number;
}

/** A pair of modules. */
export interface CalibrationPair {
  /** How long they have seen the walker together, s. */
  common_s: number;
  /** Their names. */
  modules: [string, string];
  /** How long they should, s. */
  needed_s: number;
  /** How far apart they see the walker, m; after finish. */
  residual_m: number | null;
}

/** A place as a walker finds it. */
export interface CalibrationPlace {
  /** On which side of it. */
  side: CalibrationSide;
  /** Steps from the module, at least one. */
  steps: number;
}

/** How good the whole is, and by which figures. */
export interface CalibrationQuality {
  /** How far apart two modules see the walker, m: median of the pairs. */
  apart_m: number;
  /** In a word. */
  grade: CalibrationGrade;
  /** Length of wall that two of them see and that fits, too, m; null if it is too short to help. */
  wall_m: number | null;
  /** Within which the worst of them is with 95 %, m. */
  within_m: number;
}

/** Why nothing was found. */
export type CalibrationRefusal =
  | { is: "alone" }
  | { is: "apart"; module: string }
  | { is: "apart-floor"; module: string }
  | { common_s: number; is: "short"; needed_s: number; one: string; other: string }
  | { common_s: number; is: "short-floor"; needed_s: number; one: string; other: string }
  | { is: "narrow"; one: string; other: string; spread_m: number }
  | { is: "narrow-floor"; one: string; other: string; spread_m: number }
  | { is: "contradiction"; one: string; other: string; share: number }
  | { is: "vague"; module: string; within_deg: number; within_m: number }
  | { is: "unsolved" }
  | { is: "site-changed" };

/** On which side of a module a place is. */
export type CalibrationSide = "ahead" | "ahead-left" | "ahead-right" | "left" | "right";

/** How far it is. */
export interface CalibrationStatus {
  /** Whether a calibration has begun. */
  active: boolean;
  /** What to do now, in words. */
  advice: string;
  /** The same, for pages that say it in another language; null before it has begun. */
  advice_is: CalibrationAdvice | null;
  /** For how long several people were in view; those moments are not used, s. */
  crowded_s: number;
  /** Whether the guide says that it is enough. */
  enough: boolean;
  /** What was found, after finish. */
  found: CalibrationFound | null;
  /** Every pair that has seen the walker together. */
  pairs: CalibrationPair[];
  /** A place to go to, in the site as it was before. */
  place: [number, number] | null;
  /** How much of what is needed is there, 0 to 1. */
  progress: number;
  /** Why nothing was found, after finish. */
  refused: string | null;
  /** The same, for pages that say it in another language. */
  refused_is: CalibrationRefusal | null;
  /** Modules that see the walker now. */
  sees: string[];
  /** How long ago, s. */
  since_s: number;
}

/** A step of a calibration. */
export interface CalibrationStep {
  /** Which. */
  do: CalibrationDo;
}

/** A card or a tag, as a hash that only this site can make: the number on it is never kept. */
export type Card = string;

/** A part that both have changed, each in another way. */
export interface Conflict {
  /** Its place in the merged site, which has mine there, or theirs if mine is none. */
  index: number;
  /** What it is. */
  kind: Kind;
  /** What people call it. */
  label: string;
  /** What I made of it; null: I took it away. */
  mine: unknown;
  /** What they made of it; null: they took it away. */
  theirs: unknown;
}

/** Whether the leaf is shut. */
export type Contact = "open" | "shut";

/** How many people were in a zone from some time on. */
export interface Count {
  /** ms since 1970. */
  at_ms: number;
  /** People; none where that is not known. */
  count: number | null;
  /** How far that can be trusted. */
  state: ZoneKnown;
  /** Its name. */
  zone: string;
}

/** A line across which people are counted. */
export interface CountingLine {
  /** Where it begins. */
  from: [number, number];
  /** Its name. */
  name: string;
  /** Where it ends. *In* is to the left of the way from one to the other. */
  to: [number, number];
}

/** A grid of which modules see what. */
export interface Coverage {
  /** What is seen by the same modules, the largest first. */
  areas: CoverageArea[];
  /** Side of a cell, m. */
  cell_m: number;
  /** Cells in a row. */
  columns: number;
  /** The area of each cell, row by row, from the lowest: 0 is seen by no module, 1 is the first of areas. */
  seen_by: number[];
  /** Square metres seen by at least one, and by at least two modules. */
  seen_m2: [number, number];
  /** Lower left corner. */
  x: number;
  /** Lower left corner. */
  y: number;
}

/** What is seen by the same modules. */
export interface CoverageArea {
  /** How large it is, m². */
  m2: number;
  /** Their names, in the order of the site; at least one. */
  modules: string[];
}

/** What the modules see, and what is expected of them. */
export interface Covered {
  /** All zones together. */
  all: Share;
  /** What no module sees, the largest first. */
  blind: Spot[];
  /** Side of a cell, m. */
  cell_m: number;
  /** Middle of each cell, and what sees it: 0 nothing, 1 one module or several on one side, 2 modules on two sides. */
  cells: [number, number, number][];
  /** What is expected by how much is seen alone, of rooms that were simulated before; empty: none of them is like this site. */
  estimated: Expectation[];
  /** What the simulator expects; null: it was not asked. */
  expected: Expected | null;
  /** Where one more module would help most; none where it would not, or no module is heard whose like it could be. */
  next: Next | null;
  /** Where modules were moved to when, the newest first; null without a database. */
  poses: Posed[] | null;
  /** When this was found. */
  unix_ms: number;
  /** Each zone. */
  zones: Share[];
}

/** A counting line in a frame. */
export interface CrossedLine {
  /** Inward; none if it was never seen. */
  in: number | null;
  /** As the site calls it. */
  name: string;
  /** Outward; none if it was never seen. */
  out: number | null;
  /** Whether it is seen now. */
  state: ZoneKnown;
  /** Tracks that were not followed since the start, as there were too many near it at once; they may have crossed uncounted. */
  unfollowed?: number;
  /** For how long it was not known since the start, s. */
  unknown_s: number;
}

/** The condition at a device. */
export interface DeviceCondition {
  /** What the alarm is decided on there; null where it cannot ring: of that device nothing is measured for it. */
  condition: AlarmCondition | null;
  /** As the site calls it. */
  device: string;
}

/** What a device did. */
export type DeviceEvent =
  | "learn-started"
  | "learned"
  | "learn-restarted"
  | "absorbed"
  | "background-forgotten"
  | "background-drifted"
  | "settings-changed"
  | "restarting"
  | "address-unusable"
  | "address-returned"
  | "address-default"
  | "factory-reset"
  | "keys-set"
  | "image-on-trial"
  | "image-confirmed"
  | "image-reverted"
  | "image-forged"
  | "image-damaged"
  | "image-other"
  | "image-too-old"
  | "unknown";

/** What a device is doing. */
export type DeviceState = "missing" | "found" | "searching" | "learning" | "watching" | "storing";

/** It is done, and there is nothing to say of it. */
export type Done = Record<string, never>;

/** A door. */
export interface Door {
  /** Longest time from the card to the number, s. */
  ask_s: number;
  /** Longest time a number is compared with the count before it is asked again, s. */
  check_s: number;
  /** Longest time from the lock to a leaf that is shut, s; then it is held open. */
  close_s: number;
  /** How long the door stays open for a person who wants out, s. */
  exit_s: number;
  /** What the lock does in trouble. */
  fail: Fail;
  /** The line across which people go in, in either direction. */
  line: [[number, number], [number, number]];
  /** Its name. */
  name: string;
  /** And for each further one, s. */
  next_s: number;
  /** How long the door stays unlocked for the first of a group, s. */
  pass_s: number;
  /** A card that went in is not taken again for so long, s. */
  passback_s: number;
  /** Most people who may enter at once. */
  people_max: number;
  /** Where cards are shown; the middle of the line, by default. */
  reader?: [number, number] | null;
  /** Numbers that may be tried with one card. */
  tries_max: number;
  /** Also modules without a key are believed: their reports can be forged. */
  without_keys?: boolean;
  /** The zone before it, in which people are counted. */
  zone: string;
}

/** Why there is an alarm. */
export type DoorAlarm =
  | "followed"
  | "ran-in"
  | "turned-back"
  | "passed-back"
  | "went-in"
  | "held-open"
  | "trouble";

/** The state of a door, for every client that shows it. */
export interface DoorLine {
  /** Why there is an alarm, if there is one. */
  alarm: DoorAlarm | null;
  /** Number of that output. */
  alarm_id: number;
  /** Whether the alarm has taken it. */
  alarm_taken: boolean;
  /** Whether the leaf is shut; none: not reported yet. */
  contact: Contact | null;
  /** The number entered last. */
  entered: number;
  /** What the lock is to be. */
  lock: Lock;
  /** Number of that output, and whether the lock has taken it. */
  lock_id: number;
  /** Whether the lock has taken it. */
  lock_taken: boolean;
  /** Its name. */
  name: string;
  /** Which track showed which card, so probably. */
  names?: DoorName[];
  /** Counts passages. */
  passage: number;
  /** Most people who may be entered. */
  people_max: number;
  /** Where it is. */
  phase: Phase;
  /** The same, in words. */
  prompt: string;
  /** What the entrant is to do, for programs. */
  prompt_name: DoorPrompt;
  /** While it has failed: the alarm that stands beneath, and goes on after that. */
  standing?: DoorAlarm | null;
  /** How many have gone through. */
  through: number;
  /** Numbers that may still be tried. */
  tries_left: number;
  /** What is wrong, while it has failed. */
  trouble: DoorTrouble | null;
}

/** A track and a card. */
export interface DoorName {
  /** The first digits of the card's hash. */
  label: string;
  /** How likely they belong together, 0 to 1. */
  likelihood: number;
  /** The track. */
  track: number;
}

/** What the entrant is to do. */
export type DoorPrompt =
  | "starting"
  | "ready"
  | "how-many"
  | "counting"
  | "go-in"
  | "closing"
  | "let-shut"
  | "out-of-order"
  | "called"
  | "not-seen"
  | "count-again"
  | "stand-apart"
  | "begin-again";

/** A door. */
export interface DoorRead {
  /** Longest time from the card to the number, s. */
  ask_s?: number;
  /** Longest time a number is compared with the count before it is asked again, s. */
  check_s?: number;
  /** Longest time from the lock to a leaf that is shut, s; then it is held open. */
  close_s?: number;
  /** How long the door stays open for a person who wants out, s. */
  exit_s?: number;
  /** What the lock does in trouble. */
  fail: Fail;
  /** The line across which people go in, in either direction. */
  line: [[number, number], [number, number]];
  /** Its name. */
  name: string;
  /** And for each further one, s. */
  next_s?: number;
  /** How long the door stays unlocked for the first of a group, s. */
  pass_s?: number;
  /** A card that went in is not taken again for so long, s. */
  passback_s?: number;
  /** Most people who may enter at once. */
  people_max?: number;
  /** Where cards are shown; the middle of the line, by default. */
  reader?: [number, number] | null;
  /** Numbers that may be tried with one card. */
  tries_max?: number;
  /** Also modules without a key are believed: their reports can be forged. */
  without_keys?: boolean;
  /** The zone before it, in which people are counted. */
  zone: string;
}

/** A door, and its last passages. */
export interface DoorState {
  /** Why there is an alarm, if there is one. */
  alarm: DoorAlarm | null;
  /** Number of that output. */
  alarm_id: number;
  /** Whether the alarm has taken it. */
  alarm_taken: boolean;
  /** Whether the leaf is shut; none: not reported yet. */
  contact: Contact | null;
  /** The number entered last. */
  entered: number;
  /** What the lock is to be. */
  lock: Lock;
  /** Number of that output, and whether the lock has taken it. */
  lock_id: number;
  /** Whether the lock has taken it. */
  lock_taken: boolean;
  /** Its name. */
  name: string;
  /** Which track showed which card, so probably. */
  names?: DoorName[];
  /** Counts passages. */
  passage: number;
  /** The last passages, newest first. */
  passages: Passed[];
  /** Most people who may be entered. */
  people_max: number;
  /** Where it is. */
  phase: Phase;
  /** The same, in words. */
  prompt: string;
  /** What the entrant is to do, for programs. */
  prompt_name: DoorPrompt;
  /** While it has failed: the alarm that stands beneath, and goes on after that. */
  standing?: DoorAlarm | null;
  /** How many have gone through. */
  through: number;
  /** Numbers that may still be tried. */
  tries_left: number;
  /** What is wrong, while it has failed. */
  trouble: DoorTrouble | null;
  /** This machine's time, ms since 1970: for senders to set their stamps by. */
  unix_ms: number;
}

/** Why a door does not know what happens. */
export type DoorTrouble = "starting" | "no-frames" | "module-lost" | "no-key" | "unseen" | "site-changed";

/** Datagrams that were not used, by cause. */
export interface Drops {
  /** From the future: begun later than AHEAD_S after it arrived. */
  ahead: number;
  /** In clear, in the name of a device that has a key. */
  clear: number;
  /** An exchange of times that cannot be, or that contradicts the ones before. */
  clock: number;
  /** The device's clock, setup or geometry is not known yet. */
  early: number;
  /** In the name of a device that answers at another address. */
  foreign: number;
  /** Sealed, but not by the holder of the key, or changed on the way, or of a session that is over. */
  forged: number;
  /** A report whose number is far from those of the row that goes on. */
  jump: number;
  /** A device refuses the site's key. */
  key: number;
  /** Older than LATE_S. */
  late: number;
  /** Came before. */
  repeated: number;
  /** Sealed, and taken before. */
  replayed: number;
  /** Of one of two devices that have the same place in the site. */
  same_name: number;
  /** From a start of the device that is over. */
  stale_boot: number;
  /** An answer to nothing that was asked. */
  unasked: number;
  /** The device has no place in the site. */
  unplaced: number;
  /** Not a device's datagram, or not a version understood. */
  unreadable: number;
}

/** How long people have stayed in a zone, since the start. */
export interface DwellLine {
  /** How many were at most as long as each of BOUNDS_S, and longer than the bound before; longer ones are in none. */
  parts: [number, number, number, number, number, number, number, number];
  /** Stays that have ended. */
  stays: number;
  /** All of them together, s. */
  sum_s: number;
  /** The zone. */
  zone: string;
}

/** A line across which people come and go. */
export interface Entry {
  /** Its ends, in either direction. */
  line: [[number, number], [number, number]];
  /** Its name. */
  name: string;
  /** The zone it leads to; by default the only one that counts. */
  zone: string | null;
}

/** A line across which people come and go. */
export interface EntryRead {
  /** Its ends, in either direction. */
  line: [[number, number], [number, number]];
  /** Its name. */
  name: string;
  /** The zone it leads to; by default the only one that counts. */
  zone?: string | null;
}

/** Something that happened. */
export interface Event {
  /** ms since 1970. */
  at_ms: number;
  /** What. */
  kind: EventKind;
  /** The alarm or the state, if the event is about one that this version knows. */
  name?: EventName | null;
  /** Zone, module or door. */
  subject: string;
  /** In words. */
  text: string;
  /** The track, if the event is about one. */
  track: number | null;
}

/** enter, leave, alarm, cleared, state, passage, door-alarm, restored, discarded, set-aside, raw, what a device has done, or a kind of another version. */
export type EventKind = string;

/** Something that a module did: with its background, its settings or itself. */
export interface EventLine {
  /** Since then, s. */
  ago_s: number;
  /** In which of its starts. */
  boot: number;
  /** What it did. */
  kind: DeviceEvent;
  /** Counts the events of that start, from 1. */
  number: number;
  /** What it is, in words, and which host asked for it, if one did. */
  text: string;
}

/** What an event is about, by its name. */
export type EventName = AlarmKind | DeviceState;

/** An area in which no person is counted and no track begins: of shelves, machines, a neighbour's ground. */
export interface Exclude {
  /** Its name. */
  name: string;
  /** Its corners, at least three. */
  polygon: [number, number][];
}

/** An area in which no person is counted and no track begins: of shelves, machines, a neighbour's ground. */
export interface ExcludeRead {
  /** Its name. */
  name?: string;
  /** Its corners, at least three. */
  polygon: [number, number][];
}

/** What is to be expected with so many people. */
export interface Expectation {
  /** In the best of them. */
  best: number;
  /** Share of the time in which the count is right, on the mean of the layouts that are like this one. */
  exact: number;
  /** How many they are. */
  layouts: number;
  /** So many people in the zones together. */
  people: number;
  /** In the worst of them. */
  worst: number;
}

/** What the simulator expects of this site. */
export interface Expected {
  /** Share of the time in which the count is right, and its interval at 95 %. */
  exact: number;
  exact_95: [number, number];
  /** Whether the modules stood where they are now. */
  is_of_now: boolean;
  people: number;
  runs: number;
}

/** The reasons. */
export interface Explained {
  /** Alarms of that name: those that stand, and those of the last day. */
  listed?: ListedAlarm[] | null;
  /** In words, a sentence each. */
  words: string[];
}

/** What the lock does when it is unknown what happens at the door. */
export type Fail = "secure" | "safe";

/** What the database has of a time, if there is one. */
export type FiguresAnswer = FiguresKept | NotKept;

/** A part of the time. */
export interface FiguresBin {
  /** When it begins, ms since 1970. */
  from_ms: number;
  /** Each counting line, by its name. */
  lines: Record<string, LineFigures>;
  /** When it ends. */
  to_ms: number;
  /** Each zone, by its name. */
  zones: Record<string, ZoneFigures>;
}

/** Something that is kept. */
export interface FiguresKept {
  /** The bins. */
  bins: FiguresBin[];
  /** There is a database. */
  kept: true;
}

/** A file that is handed out. */
export interface FirmwareFile {
  /** The board; null: it is of none. */
  board: string | null;
  /** Its length. */
  bytes: number;
  /** Its name. */
  name: string;
  /** What it is for. */
  purpose: Purpose;
}

/** All that is handed out. */
export interface FirmwareFiles {
  /** Whether the boot loaders take updates signed with the development key, whose secret everybody has; null: not known. */
  development_key: boolean | null;
  /** Board by board. */
  files: FirmwareFile[];
  /** Where on the tracker's machine they lie. */
  folder: string;
}

/** A floor of pressure panels. */
export interface Floor {
  /** Columns. */
  columns: number;
  /** Its name, MAC or instance name. */
  name: string;
  /** Side of a panel. */
  pitch_m: number;
  /** Rows. */
  rows: number;
  /** The outer corner of panel (0, 0). */
  x: number;
  /** The same. */
  y: number;
  /** Where columns go. */
  yaw_deg: number;
}

/** What a floor of pressure panels shows. Panels are numbered row by row: row · columns + column. */
export interface FloorLine {
  /** Its columns. */
  columns: number;
  /** Those that never go down. */
  dead?: number[];
  /** The panels that are down. */
  down: number[];
  /** As the site calls it. */
  name: string;
  /** Those that never come up. */
  stuck?: number[];
  /** From this panel on nothing is known: more do not work than a reading names. */
  unknown_from?: number | null;
}

/** A floor of pressure panels. */
export interface FloorRead {
  /** Columns. */
  columns: number;
  /** Its name, MAC or instance name. */
  name: string;
  /** Side of a panel. */
  pitch_m?: number;
  /** Rows. */
  rows: number;
  /** The outer corner of panel (0, 0). */
  x: number;
  /** The same. */
  y: number;
  /** Where columns go. */
  yaw_deg?: number;
}

/** What is known at one time. */
export interface Frame {
  /** Every alarm that stands, of the tracker itself, of modules and of doors, the oldest first. */
  alarms?: ListedAlarm[];
  /** Every guarded door of the site. */
  doors?: DoorLine[];
  /** Datagrams of modules that were not used, since the start. */
  dropped: Drops;
  /** How long people have stayed in each zone, since the start. */
  dwell?: DwellLine[];
  /** Every floor of pressure panels that is read. */
  floors?: FloorLine[];
  /** HTTP connections and requests that were refused or ended, since the start. */
  http: HttpRefused;
  /** Every counting line of the site. */
  lines?: CrossedLine[];
  /** Snapshots that the database, MQTT or another sink did not get, as it had fallen behind, since the start. */
  missed: number;
  /** Every module of the site, and every one that was found beside them. */
  modules: ModuleLine[];
  /** Every ID that was read within the last hour, and which tracks it may be. */
  names?: NameLine[];
  /** Datagrams that were dropped as the tracker had fallen behind, since the start. */
  overrun: number;
  /** Announced devices that were not asked, or are no longer known, since the start. */
  refused: Refused;
  /** Signs since the start, by what became of them. */
  signs: SignCounts;
  /** Datagrams from addresses that are no device of ours, since the start. */
  strangers: number;
  /** Time the states are predicted to, s. */
  t: number;
  /** How many people are in the whole site. */
  total: Total;
  /** All tracks, tentative ones included. */
  tracks: TrackLine[];
  /** Milliseconds since 1970 when it was made, by this machine's clock: for people and databases, never for computing. */
  unix_ms: number;
  /** What is known of each zone, by its name. */
  zones: Record<string, ZoneLine>;
}

/** What the database has of a time, if there is one. */
export type HeatAnswer = HeatKept | NotKept;

/** Something that is kept. */
export interface HeatKept {
  /** Side of a cell, m. */
  cell_m: number;
  /** Time of each, s, row by row from the lowest; null: no person was seen there, and no module that sees it was watching. */
  cells: (number | null)[];
  /** Cells in a row. */
  columns: number;
  /** Time of people who were hidden, and of those outside the cells, s. */
  hidden_s: number;
  /** There is a database. */
  kept: true;
  outside_s: number;
  /** Rows. */
  rows: number;
  /** How long each module was watching, s. */
  watched: Record<string, number>;
  /** Lower left corner, m. */
  x: number;
  /** Lower left corner, m. */
  y: number;
}

/** HTTP connections and requests that were refused or ended, by cause. */
export interface HttpRefused {
  /** An address had its share of the places. */
  address: number;
  /** The body of a request did not come in time. */
  body: number;
  /** The host or the page that asked is not allowed. */
  foreign: number;
  /** All places for connections were taken. */
  full: number;
  /** No whole header of a request came in time; a connection that was kept open for nothing is one of these. */
  header: number;
  /** Passwords were tried too often. */
  often: number;
  /** Who asked may not do this. */
  role: number;
  /** No TLS could be agreed, or a request came without it. */
  tls: number;
  /** Who asked is not known, or the password was wrong. */
  unknown: number;
  /** A client did not take what it was sent, or did not answer. */
  unread: number;
}

/** How long to blink. */
export interface Identify {
  /** For so many seconds, 60 at most; 0: no more; without it, half a minute. */
  seconds?: number;
}

/** A track that may be in a zone. */
export interface Inside {
  /** Whether its mean is inside: else it is at the edge, and not counted here. */
  is_inside: boolean;
  /** Probability that it is there at all and inside. */
  probability: number;
  /** What it is to the count. */
  role: Role;
  /** Its number. */
  track: number;
}

/** What a part of a site is. */
export type Kind =
  | "module"
  | "floor"
  | "wall"
  | "zone"
  | "entry"
  | "line"
  | "mover"
  | "exclude"
  | "door"
  | "reader";

/** How to learn. */
export interface Learn {
  /** Scans to learn from; 0: as many as its setting says. */
  scans?: number;
}

/** Why a track exists. */
export type Life =
  | { is: "seen" }
  | { is: "hidden" }
  | { is: "tentative" }
  | { is: "unexplained" }
  | { is: "part"; of: number };

/** Where a track is in its life. */
export type LifeCycle = "tentative" | "confirmed" | "occluded";

/** A track that may be the one of an ID. */
export interface Likelihood {
  /** How probable that is, 0 to 1. */
  probability: number;
  /** The track. */
  track: number;
}

/** A line within a bin. */
export interface LineFigures {
  /** Inward; none if no person was seen to cross and the line was not seen all the time. */
  in: number | null;
  /** Outward; none if no person was seen to cross and the line was not seen all the time. */
  out: number | null;
  /** For how long not all of the line was seen, s. */
  unknown_s: number;
}

/** An alarm, as it is listed and written. */
export interface ListedAlarm {
  /** Who has acknowledged it; absent until then. */
  acknowledged?: Acknowledged | null;
  /** Its number: another each time it begins. */
  id: number;
  /** Why, for programs. */
  name: AlarmName;
  /** The name of the device, door or zone. */
  of?: string;
  /** How much that takes away. */
  severity: Severity;
  /** When it began, ms since 1970. */
  since_ms: number;
  /** What it is about. */
  source: About;
  /** What it is and what to do, in words. */
  text: string;
  /** When it ended, ms since 1970; absent while it stands. */
  until_ms?: number | null;
}

/** What the lock is to be. It inhibits entry only: from inside the handle always opens. */
export type Lock = "locked" | "unlocked" | "exit";

/** What the lock is to be, and for how long. */
export interface LockOrder {
  /** It locks by itself after so long, ms, if it is told nothing more. None: until the next order. */
  for_ms?: number | null;
  /** Number of the output. */
  id: number;
  /** What it is to be. */
  lock: Lock;
  /** The lock's newest number, if it has said one. */
  nonce?: Nonce | null;
}

/** What a user sends to log in. */
export interface LogIn {
  /** Their name. */
  name: string;
  /** Their password. */
  password: string;
}

/** A figure and its limit. */
export interface Measured {
  /** The alarm's condition holds beyond this. */
  limit: number;
  /** In this unit. */
  unit: Unit;
  /** It is so much. */
  value: number;
}

/** A module and where it is. */
export interface Module {
  /** What in its background has the shape of a person and is none: bearing from its front to its left, degrees, and range, m. */
  furniture?: [number, number][];
  /** Height of its plane above the floor. */
  height_m: number;
  /** Its name, MAC or instance name. */
  name: string;
  /** Whether its place is known. One that is not placed is asked and calibrated, and nothing that it sees is used. */
  placed?: boolean;
  /** Whether it hangs head down: what it has on its left is on its right. */
  upside_down?: boolean;
  /** Its place. */
  x: number;
  /** Its place. */
  y: number;
  /** Where its front step points. */
  yaw_deg: number;
}

/** How a module is. */
export interface ModuleLine {
  /** Where it answers; empty until it is found. */
  address: string;
  /** What is wrong, worst first. */
  alarms: AlarmLine[];
  /** Age of its background, s; absent while it has none. */
  background_age_s: number | null;
  /** Checksum errors on its sensor's line since it started. */
  checksum_errors: number;
  /** How much that scatters, ms; null until it was measured. */
  clock_jitter_ms: number | null;
  /** Its clock minus this machine's, ms; absent until it was measured. */
  clock_offset_ms: number | null;
  /** What it has done within the last minute, oldest first. */
  events?: EventLine[];
  /** The version of its firmware; empty until it has said so. */
  firmware?: string;
  /** What its newest scan saw empty, in the site's frame, m: the corners of an area that begins at the module. Empty while it sees nothing. What lies outside is not seen. */
  free?: [number, number][];
  /** Its identity, as hexadecimal bytes between colons; empty until it has answered. */
  id: string;
  /** Whether what it says is sealed with a key of the site. */
  is_sealed?: boolean;
  /** How much of what it learns from it has, 0 to 1; absent while it does not learn. */
  learned_share?: number | null;
  /** Share of its scans that were lost over the last minute, on whatever part of the way; null if it took none. */
  lost_share: number | null;
  /** As the site calls it, or else as it calls itself. */
  name: string;
  /** Scans a second over the last ten seconds. */
  scans_hz: number;
  /** What stands out in its newest scan, in its own frame, m: of a module that the site has, but not its place. */
  sees?: [number, number][];
  /** Since its last datagram, s; absent until there was one. */
  silent_s: number | null;
  /** What it is doing. */
  state: DeviceState;
  /** Where something in its background has the shape of a person, as far as the site does not say that it is furniture: bearing from its front to its left, degrees, and range, m, as Module::furniture has them. */
  suspects?: [number, number][];
  /** Share of its beams that could not be judged in the newest report. */
  unknown_share: number;
  /** Since a report of it was used last, s; absent until one was. */
  unused_s?: number | null;
}

/** A module and where it is. */
export interface ModuleRead {
  /** What in its background has the shape of a person and is none: bearing from its front to its left, degrees, and range, m. */
  furniture?: [number, number][];
  /** Height of its plane above the floor. */
  height_m?: number;
  /** Its name, MAC or instance name. */
  name: string;
  /** Whether its place is known. One that is not placed is asked and calibrated, and nothing that it sees is used. */
  placed?: boolean;
  /** Whether it hangs head down: what it has on its left is on its right. */
  upside_down?: boolean;
  /** Its place. */
  x: number;
  /** Its place. */
  y: number;
  /** Where its front step points. */
  yaw_deg?: number;
}

/** Settings of a module. */
export interface ModuleSettings {
  /** Each by its key, as docs/wire.md has them. */
  settings: Record<string, string>;
}

/** An area in which a door leaf, a curtain or a fan moves. */
export interface Mover {
  /** Its name. */
  name: string;
  /** Its corners, at least three. */
  polygon: [number, number][];
}

/** An area in which a door leaf, a curtain or a fan moves. */
export interface MoverRead {
  /** Its name. */
  name?: string;
  /** Its corners, at least three. */
  polygon: [number, number][];
}

/** An ID, and the tracks that may be it. */
export interface NameLine {
  /** Since it was read last, s. */
  heard_s: number;
  /** Its first digits. */
  label: string;
  /** Since it was read last at a place that is known, s: its tracks go by that. Absent while it never was. */
  read_s?: number | null;
  /** The likeliest first; empty while it is not known which track it is. */
  tracks: Likelihood[];
  /** The zones in which the likeliest is. */
  zones?: string[];
}

/** Where one more module would help most. */
export interface Next {
  /** Share that would be seen by at least one module then. */
  one: number;
  /** Share that would be seen from two sides. */
  two: number;
  /** Its place. */
  x: number;
  /** Its place. */
  y: number;
  /** Where its front points. */
  yaw_deg: number;
}

/** A number that a lock makes for each time it says that it is ready, of any sort that does not come again soon. */
export type Nonce = number;

/** The tracker runs without a database. */
export interface NotKept {
  /** There is none. */
  kept: false;
}

/** Nothing more is to be said. */
export type Nothing = Record<string, never>;

/** How a track came to be, and with that whether it is a person of its own. */
export type Origin = "entered" | "unexplained" | { "part-of": number };

/** Another open editor. */
export interface OtherEditor {
  /** The user or program that has it open; null if not known by name. */
  name: string | null;
}

/** What the database has of a time, if there is one. */
export type OverviewAnswer = OverviewKept | NotKept;

/** Something that is kept. */
export interface OverviewKept {
  /** The most people at once in each bin. */
  bins: (number | null)[];
  /** What happened, without comings and goings. */
  events: Event[];
  /** The first time there is something of; absent while the database is empty. */
  first_ms: number | null;
  /** When it begins, ms since 1970. */
  from_ms: number;
  /** There is a database. */
  kept: true;
  /** Events there was no room for. */
  left_out: number;
  /** When it ends. */
  to_ms: number;
}

/** One group from its card to the lock. */
export interface Passage {
  /** The alarm, if there was one. */
  alarm: DoorAlarm | null;
  /** When the card was shown, s on the doors' own clock, which starts with the program. */
  begun_s: number;
  /** The card; none when a person went in without. */
  card: Card | null;
  /** The count's distribution when the door was unlocked, or when it was refused last. */
  count_p: number[];
  /** The door. */
  door: string;
  /** When it was over, on the same clock. */
  ended_s: number;
  /** The number entered last; 0 if none was. */
  entered: number;
  /** Tracks in the zone when the door was unlocked. */
  group: number[];
  /** Counts the door's passages since the start, from 1. */
  number: number;
  /** How it ended. */
  outcome: PassageOutcome;
  /** Why, in words. */
  reason: string;
  /** Share of the zone that was seen then. */
  seen_share: number;
  /** Tracks that went through, in order. */
  through: number[];
  /** Numbers that were checked. */
  tries: number;
}

/** How a passage ended. */
export type PassageOutcome =
  | "complete"
  | "fewer"
  | "gave-up"
  | "refused"
  | "alarmed"
  | "held-open"
  | "trouble";

/** A passage, with its time of day. */
export interface Passed {
  /** ms since 1970. */
  begun_ms: number;
  /** ms since 1970. */
  ended_ms: number;
  /** The record. */
  passage: Passage;
}

/** What was known at a time. */
export interface PastLine {
  /** How many people were in the whole site, as it was then. */
  total: Total;
  /** All tracks. */
  tracks: TrackLine[];
  /** When, ms since 1970. */
  unix_ms: number;
  /** Each zone by its name. */
  zones: Record<string, PastZone>;
}

/** What was known of a zone. */
export interface PastZone {
  /** People; null where 0 would say more than is known. */
  count: number | null;
  /** How much of it was seen. */
  state: ZoneKnown;
}

/** A part of a zone that is not seen. */
export interface Patch {
  /** A cell near its middle. */
  at: [number, number];
  /** The middles of its cells. */
  cells: [number, number][];
  /** That module; none where none reaches it. */
  module: string | null;
  /** When some of it was seen last, s ago; none if never. */
  seen_ago_s: number | null;
  /** Its area, m²; of a line its length, m. */
  size: number;
  /** Why the module does not see it that is nearest to seeing it. */
  why: Why;
}

/** A track's path. */
export interface PathWalked {
  /** Where it was: ms since 1970, x mm, y mm, and 1 where it was occluded, else 0. */
  places: [number, number, number, number][];
  /** The start of the tracker it belongs to; numbers of tracks start again with each. */
  run: number;
  /** The track's number. */
  track: number;
}

/** What the database has of a time, if there is one. */
export type PathsAnswer = PathsKept | NotKept;

/** Something that is kept. */
export interface PathsKept {
  /** Counts of zones when they changed, and the one before for each. */
  counts: Count[];
  /** What happened. */
  events: Event[];
  /** There is a database. */
  kept: true;
  /** When the tracker ran: from, to. */
  lives: [number, number][];
  /** The path of each track. */
  paths: PathWalked[];
}

/** Why a track exists, and who sees it. */
export interface PersonReasons {
  /** Where it is. */
  at: [number, number];
  /** When it was detected first, s ago. */
  born_ago_s: number | null;
  /** Where. */
  born_at: [number, number] | null;
  /** Probability that a person is there at all. */
  existence: number;
  /** Why it is there. */
  life: Life;
  /** Modules that have detected it, or whose range reaches it; who has seen it last comes first. */
  modules: Sighting[];
  /** What happened to it last, in words. */
  note: string;
  /** When any module detected it last, s ago. */
  seen_ago_s: number | null;
  /** Its number. */
  track: number;
  /** The zones it is in. */
  zones: string[];
}

/** Where a door is. */
export type Phase =
  | "idle"
  | "asked"
  | "checking"
  | "unlocked"
  | "closing"
  | "held-open"
  | "alarmed"
  | "failed";

/** Whether there is one, and where it lies. */
export interface PictureLaid {
  /** Whether there is one. */
  picture: boolean;
  /** Where it lies; null: nowhere yet. */
  place: Place | null;
}

/** Where a picture lies. */
export interface Place {
  /** See width. */
  height: number;
  /** How large a pixel is, m. */
  m_per_px: number;
  /** Where its upper side goes, counter-clockwise. */
  turn_deg: number;
  /** Its size, pixels. */
  width: number;
  /** Its upper left corner, m. */
  x: number;
  /** See x. */
  y: number;
}

/** Where a module's pose comes from, by its name in the database. */
export type PoseSource = "file" | "map" | "calibration";

/** Where a module was from some time on. */
export interface Posed {
  /** ms since 1970. */
  at_ms: number;
  /** As the site called it. */
  module: string;
  /** Where the pose came from. */
  source: PoseSource;
  /** Its place, m. */
  x_m: number;
  /** m. */
  y_m: number;
  /** Where its front pointed, counter-clockwise. */
  yaw_deg: number;
}

/** Parts that a site lacks. */
export interface Proposal {
  /** Gaps through which people come into these rooms. */
  entry: Entry[];
  /** Walls. */
  wall: Wall[];
  /** Rooms, as zones whose people are counted. */
  zone: Zone[];
}

/** What a file is for. */
export type Purpose = "drive" | "debugger" | "program" | "udev" | "sums";

/** A reader. */
export interface Reader {
  /** Of a camera: pixel (u, v, 1) to a place on the floor, row by row. */
  homography?: [number, number, number, number, number, number, number, number, number] | null;
  /** Its name. */
  name: string;
  /** How far it reads, m. */
  reach_m?: number | null;
  /** Spread of such a place along each axis, m; 0.2 if it is not said. */
  sigma_m?: number | null;
  /** Its place, m, with y and reach_m; or else it has a homography. */
  x?: number | null;
  /** See x. */
  y?: number | null;
}

/** Why something was not done. */
export interface Refusal {
  /** In words: what is wrong, where, and what to do. */
  error: string;
}

/** Announced devices that were not asked, or are no longer known, by cause. */
export interface Refused {
  /** There were too many: the oldest that had never answered was given up, or the new one. */
  crowded: number;
  /** Devices that answered, and were given up for newer ones. */
  forgotten: number;
  /** Addresses outside the networks of this host. */
  outside: number;
}

/** Another name. */
export interface Rename {
  /** It. */
  name: string;
}

/** A module has another name. */
export interface Renamed {
  /** Its new name. */
  name: string;
  /** The site's new revision, if the site called it by the old one. */
  revision?: number | null;
}

/** All tracks, right after a report. */
export interface ReportLine {
  /** The module of the report, as the site names it. */
  module: string;
  /** The report's number. */
  sequence: number;
  /** When the report had arrived and was used, s on the tracker's clock: that of frames. */
  t: number;
  /** All tracks, as in a snapshot. */
  tracks: TrackLine[];
}

/** The site has changed. */
export interface Revised {
  /** What was changed meanwhile, and is kept. */
  merged?: string[];
  /** Its new revision. */
  revision: number;
}

/** What a track is to the number of people in a zone. */
export type Role = "counted" | "tentative" | "unexplained" | "part";

/** Who asks, and what the page shows them. */
export interface Session {
  /** What they may do. */
  may: string[];
  /** The user's name, or that of the token; null for a client that is not known. */
  name: string | null;
  /** Whether anybody has to log in here. */
  needed: boolean;
  /** Their role; null for programs, which may have several. */
  role: string | null;
  /** The tracker's version; absent for a client that may not look. */
  version?: string | null;
}

/** How much an alarm takes away; the order is that of the enum, the least first. */
export type Severity = "notice" | "degraded" | "failed";

/** How much of a zone is seen. */
export interface Share {
  /** What no module sees, m². */
  blind_m2: number;
  /** Its area, m². */
  m2: number;
  /** Share seen by at least one module. */
  one: number;
  /** Share seen from two sides. */
  two: number;
  /** Its name; of all together empty. */
  zone: string;
}

/** A module, and what it has of a track. */
export interface Sighting {
  /** As the site calls it. */
  module: string;
  /** When it detected the track last, s ago; null if never. */
  seen_ago_s: number | null;
  /** Why it does not see it now, where it is believed to be. */
  why: Why;
}

/** What a reader has read, and where. */
export interface Sign {
  /** When, ms since 1970; without it, now. */
  at_ms?: number | null;
  /** The ID that was read: 1 to 128 characters, of which only a keyed hash is kept. */
  id: string;
  /** The reader of the site that has read it. */
  reader?: string | null;
  /** Spread of that place along each axis, m. */
  sigma_m?: number | null;
  /** Of a camera: the pixel's column, with v. */
  u?: number | null;
  /** Of a camera: the pixel's row. */
  v?: number | null;
  /** Without a reader: where, m, with y. */
  x?: number | null;
  /** See x. */
  y?: number | null;
}

/** Signs since the start, by what became of them. */
export interface SignCounts {
  /** There were too many IDs. */
  full: number;
  /** Read too long ago, or in the future. */
  late: number;
  /** Malformed. */
  malformed: number;
  /** At no place. */
  no_place: number;
  /** Of a reader that the site does not have. */
  no_reader: number;
  /** Used. */
  taken: number;
  /** No tracks were known at their time. */
  untracked: number;
}

/** Modules with their poses, walls, zones, entries, lines, movers, doors, readers and floors. */
export interface Site {
  /** Doors that let in as many people as were entered. */
  door?: Door[];
  /** Lines across which people come and go. */
  entry: Entry[];
  /** Areas in which no person is counted. */
  exclude?: Exclude[];
  /** Floors of pressure panels. */
  floor?: Floor[];
  /** Lines across which people are counted. */
  line?: CountingLine[];
  /** The modules. */
  module: Module[];
  /** Areas in which things move that are not people. */
  mover: Mover[];
  /** Readers of cards and tags. */
  reader?: Reader[];
  /** What stops people, beams or both. */
  wall: Wall[];
  /** Areas with a meaning. */
  zone: Zone[];
}

/** Another site. */
export interface SiteChange {
  /** The site of that revision: with it, what was changed meanwhile is kept. */
  base?: SiteRead | null;
  /** The revision that was read before, so that no edit is lost; without it, whatever is there is replaced. */
  revision?: number | null;
  /** The whole site. */
  site: SiteRead;
}

/** Modules with their poses, walls, zones, entries, lines, movers, doors, readers and floors. */
export interface SiteRead {
  /** Doors that let in as many people as were entered. */
  door?: DoorRead[];
  /** Lines across which people come and go. */
  entry?: EntryRead[];
  /** Areas in which no person is counted. */
  exclude?: ExcludeRead[];
  /** Floors of pressure panels. */
  floor?: FloorRead[];
  /** Lines across which people are counted. */
  line?: CountingLine[];
  /** The modules. */
  module?: ModuleRead[];
  /** Areas in which things move that are not people. */
  mover?: MoverRead[];
  /** Readers of cards and tags. */
  reader?: Reader[];
  /** What stops people, beams or both. */
  wall?: WallRead[];
  /** Areas with a meaning. */
  zone?: ZoneRead[];
}

/** The site in use. */
export interface SiteShown {
  /** Name of its file. */
  file: string;
  /** Counts its changes; to be sent back with an edit, so that none is lost. */
  revision: number;
  /** The site. */
  site: Site;
  /** The text of its file. */
  toml: string;
}

/** A change beside what was changed meanwhile. */
export interface SiteTogether {
  /** What was changed meanwhile, in words. */
  changes: string[];
  /** What both changed, to be decided. */
  conflicts: Conflict[];
  /** Why it was not saved. */
  error?: string | null;
  /** Both in one. */
  merged: Site;
  /** The revision of the site in use. */
  revision: number;
  /** The site in use. */
  site: Site;
  /** What is wrong with it. */
  wrong: Wrong[];
}

/** A connected part of a zone that no module sees. */
export interface Spot {
  /** A cell near its middle. */
  at: [number, number];
  /** Its area, m². */
  m2: number;
  /** The zone. */
  zone: string;
}

/** What stands out from the background, for people. */
export interface Thing {
  /** Its middle, degrees from the module's front, counter-clockwise. */
  bearing_deg: number;
  /** Whether that is long enough to be absorbed. */
  is_still: boolean;
  /** How far it is, m. */
  range_m: number;
  /** For how long it has not moved, s. */
  still_s: number;
}

/** What the WebSocket sends. Each message has one key. */
export type ToClient =
  | { frame: Frame }
  | { fields: Record<string, [number, number][]> }
  | { report: ReportLine }
  | { site: number }
  | { alarms: ListedAlarm[] }
  | { editors: OtherEditor[] }
  | { error: string };

/** What has been told to the webhook, and what it did not take. */
export interface Told {
  /** Changes that were given up. */
  failed: number;
  /** Changes that it has taken. */
  sent: number;
}

/** How many people are in the whole site. */
export interface Total {
  /** People; null where that is not known. */
  count: number | null;
  /** How much of the site's zones is known. */
  state: ZoneKnown;
}

/** One track. */
export interface TrackLine {
  /** Covariance of the place: xx, xy, yy in m². */
  cov?: [number, number, number] | null;
  /** Probability that a person is there at all. */
  existence: number;
  /** Never used for another track. */
  id: number;
  /** How it came to be; not written of a track that was seen to come in. */
  origin?: Origin;
  /** Why it is in this state. */
  reason: string;
  /** Where in its life. */
  state: LifeCycle;
  /** m/s. */
  vx: number;
  /** m/s. */
  vy: number;
  /** m. */
  x: number;
  /** m. */
  y: number;
}

/** What a figure is measured in. */
export type Unit = "silent-s" | "damaged-share" | "covered-deg" | "scans-hz" | "clock-s" | "missing-share";

/** Why so much is known of a zone. */
export type Verdict =
  | { is: "seen" }
  | { for_s: number; is: "begins" }
  | { for_s: number; is: "moved" }
  | { is: "hardly-seen" }
  | { is: "partly-seen" }
  | { for_s: number; is: "not-found-again" }
  | { is: "left-unseen" }
  | { is: "may-hide"; m2: number };

/** A wall: a line of straight pieces. */
export interface Wall {
  /** What it stops. */
  blocks: Blocks[];
  /** Beams do not end at it but go on as its image shows. */
  mirror: boolean;
  /** Its corners, at least two. */
  points: [number, number][];
}

/** A wall: a line of straight pieces. */
export interface WallRead {
  /** What it stops. */
  blocks?: Blocks[];
  /** Beams do not end at it but go on as its image shows. */
  mirror?: boolean;
  /** Its corners, at least two. */
  points: [number, number][];
  /** Site files that earlier maps saved have it; a scene has its own, wall_reflectance. */
  reflectance?: unknown;
}

/** Where an ID is. */
export interface Whereabouts {
  /** Where its likeliest track is, m; none while there is no such track. */
  at: [number, number] | null;
  /** Since it was read last, s. */
  heard_s: number;
  /** Its first digits. */
  label: string;
  /** Where it was read last, m, if that was said. */
  read: [number, number] | null;
  /** Since it was read last at a place that is known, s: its tracks go by that. Absent while it never was. */
  read_s?: number | null;
  /** The likeliest first; empty while it is not known which track it is. */
  tracks: Likelihood[];
  /** The zones in which the likeliest is. */
  zones?: string[];
}

/** Why a module does not see a place; the order is from what passes by itself to what only another module changes. */
export type Why =
  | { is: "seen" }
  | { is: "person"; track: number | null }
  | { is: "silent" }
  | { is: "not-judged" }
  | { is: "thing" }
  | { is: "wall" }
  | { is: "out-of-view" }
  | { is: "too-far" }
  | { is: "no-module" };

/** What a browser may ask for. */
export interface Wish {
  /** Whether the editor is open here: a user who may change the site is told which others have it open. */
  editing?: boolean;
  /** Whether frames are wanted. */
  frames: boolean;
  /** Whether tracks are wanted after each report. */
  reports?: boolean;
}

/** Something wrong with a part. */
export interface Wrong {
  /** Its number among those. */
  index: number;
  /** Which of its keys; null: its shape, or several. */
  key: string | null;
  /** What the part is. */
  kind: Kind;
  /** A sentence that names the part and what to do. */
  text: string;
}

/** An area with a meaning. */
export interface Zone {
  /** People in it are counted. */
  count: boolean;
  /** Walls and entries surround it. Where they are drawn all around it need not be said. */
  enclosed: boolean;
  /** For how long it stays occupied for automations after the last person, s. */
  hold_s?: number | null;
  /** Its name. */
  name: string;
  /** More people in it than this raise an alarm. */
  people_max?: number | null;
  /** Its corners, at least three. */
  polygon: [number, number][];
  /** Unexplained tracks count, too. */
  secure: boolean;
}

/** A zone within a bin. */
export interface ZoneFigures {
  /** Their median, s; none without any. */
  dwell_s: number | null;
  /** People who entered; none if no person was seen to enter and not all of the zone was known all the time. */
  entered: number | null;
  /** People, the mean over the time in which their number was known; none without such a time, or if that would be 0 and their number was not known all the time. */
  mean: number | null;
  /** The most at once; none likewise. */
  most: number | null;
  /** Stays that ended; none likewise. */
  stays: number | null;
  /** For how long the number of people was not known, s. */
  unknown_s: number;
}

/** How much of a zone is known. */
export type ZoneKnown = "known" | "partly" | "unknown";

/** What is known of a zone. */
export interface ZoneLine {
  /** Number of people found; null where 0 would say more than is known. */
  count: number | null;
  /** Probability of no person, of one, of two, …; null with the count. */
  p: number[] | null;
  /** Share of the zone that some module sees. */
  seen_share: number;
  /** How much the count can be trusted. */
  state: ZoneKnown;
}

/** An area with a meaning. */
export interface ZoneRead {
  /** People in it are counted. */
  count?: boolean;
  /** Walls and entries surround it. Where they are drawn all around it need not be said. */
  enclosed?: boolean;
  /** For how long it stays occupied for automations after the last person, s. */
  hold_s?: number | null;
  /** Its name. */
  name: string;
  /** More people in it than this raise an alarm. */
  people_max?: number | null;
  /** Its corners, at least three. */
  polygon: [number, number][];
  /** Unexplained tracks count, too. */
  secure?: boolean;
}

/** Why a zone is as it is. */
export interface ZoneReasons {
  /** Side of a cell, m. */
  cell_m: number;
  /** How many are counted in it; null where that is not known, and of a line. */
  count: number | null;
  /** Who may be in it. */
  inside: Inside[];
  /** Whether it is a counting line. */
  is_line: boolean;
  /** Its name. */
  name: string;
  /** Share of it that is seen. */
  seen_share: number;
  /** Its area, m²; of a line its length, m. */
  size: number;
  /** How much is known. */
  state: ZoneKnown;
  /** What of it is not seen, the largest first. */
  unseen: Patch[];
  /** What of it is not seen beside those, m² or m. */
  unseen_more: number;
  /** Why; null of a line. */
  verdict: Verdict | null;
}
