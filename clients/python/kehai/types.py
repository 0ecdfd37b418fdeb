"""What kehai-tracker sends and takes, version 1.0.0: made by `kehai-tracker schema python`."""

from __future__ import annotations

from typing import Any, Literal, NotRequired, TypedDict

# What an alarm is about, without its name.
About = Literal["tracker", "module", "door", "zone", "area"]


class Absorb(TypedDict):
    """What is to be absorbed."""

    # Its direction, degrees from the module's front, counter-clockwise; without it, the only thing there is.
    bearing: NotRequired[float | None]


class Absorbed(TypedDict):
    """What was absorbed."""

    # The background's version after that.
    background_version: int
    # How many beams see the new background.
    beams: int
    # Its middle, degrees from the module's front, counter-clockwise.
    bearing_deg: float
    # How far it is, m.
    range_m: float


class Acknowledged(TypedDict):
    """Who has seen an alarm, and when."""

    # ms since 1970.
    at_ms: int
    # Who.
    by: str


class AlarmCondition(TypedDict):
    """What an alarm is decided on."""

    # For how long the condition has been other than the alarm, s.
    for_s: float
    # Whether its condition holds now.
    holds: bool
    # Whether it rings.
    is_on: bool
    # The alarm.
    kind: AlarmKind
    # What is measured for it, if that is a number; null while it is not known.
    measured: Measured | None
    # For how long it must hold until the alarm rings, s.
    raise_s: float


# What is wrong.
AlarmKind = Literal[
    "silent",
    "sensor",
    "line",
    "covered",
    "slow",
    "clock-off",
    "dirty",
    "store",
    "background",
    "suspect",
    "watchdog",
    "moved",
    "blind",
    "same-name",
    "panels",
    "floor-size",
    "database",
    "raw-scans",
    "recording",
    "tracks-out",
    "thread",
    "keys",
    "no-key",
    "crowded",
    "unknown",
]


class AlarmLine(TypedDict):
    """An alarm of a device or of the tracker, as it is written."""

    # What is wrong, for programs. When a device raises which: tracking/src/session/health/alarms.rs.
    name: AlarmKind
    # How much that takes away.
    severity: Severity
    # What it is and what to do, in words.
    text: str


class AlarmTold(TypedDict):
    """What is told to the webhook."""

    # The alarm after that.
    alarm: ListedAlarm
    # What became of it.
    event: Became
    # The site's name.
    site: str


class AlarmsAcknowledged(TypedDict):
    """What was acknowledged."""

    # Those that were not acknowledged before.
    acknowledged: list[ListedAlarm]


class AlarmsListed(TypedDict):
    """The alarms that stand, and those that ended within the last day."""

    # Those that ended within the last day, the newest first.
    ended: list[ListedAlarm]
    # Changes that a listener missed, as it was too slow.
    missed: int
    # Those that stand, the oldest first.
    standing: list[ListedAlarm]
    # This machine's time.
    unix_ms: int
    # What has been told to the webhook.
    webhook: Told


class AlarmsSeen(TypedDict):
    """Alarms that a user has seen."""

    # Their numbers.
    ids: list[int]


# What became of an alarm.
Became = Literal["raised", "acknowledged", "ended"]

# What a wall stops.
Blocks = Literal["people", "beams"]

# What the walker is to do.
CalibrationAdvice = TypedDict(
    "CalibrationAdvice",
    {
        "is": "Literal['single', 'alone', 'begin', 'reach', 'reach-floor', 'together', 'cross-floor', 'enough']",
        # Its name.
        "module": "NotRequired[str]",
        # The first of them.
        "one": "NotRequired[str]",
        # The other.
        "other": "NotRequired[str]",
        # Such a place, from the first of them; null if none is known.
        "place": "NotRequired[CalibrationPlace | None]",
        # The floor.
        "floor": "NotRequired[str]",
    },
)

# What the browser wants.
CalibrationDo = Literal["begin", "finish", "go-on", "accept", "stop"]


class CalibrationFound(TypedDict):
    """What was found."""

    # Which modules see what from there.
    coverage: Coverage
    # Each module's place.
    modules: list[CalibrationModule]
    # How good it is, in a sentence.
    quality: str
    # By which figures; null of a single module, whose place is by definition.
    quality_is: CalibrationQuality | None


# How good the whole is.
CalibrationGrade = Literal["very-good", "good", "fair", "poor"]


class CalibrationHang(TypedDict):
    """Which way up a module hangs, as the walk says."""

    # How far apart it and another module see the walker so, m; null: the walk does not say.
    right_m: float | None
    # Whether that is not as the site had it.
    turned: bool
    # And the other way up, m.
    wrong_m: float | None


class CalibrationModule(TypedDict):
    """A module's place."""

    # How far its clock is behind, ms.
    clock_ms: float
    # Within which its clock is with 95 %, ms; absent of a floor, which has none.
    clock_within_ms: NotRequired[float | None]
    # How clearly the walk says so; absent of the module that is held fixed, and of a floor.
    hang: NotRequired[CalibrationHang | None]
    # How far that is from where the site had it, m; absent if it had no place.
    moved_m: NotRequired[float | None]
    # Its name.
    name: str
    # How far what it saw is from the walk, m: median.
    residual_m: float
    # All that in words.
    text: str
    # Whether it hangs head down; of a floor false.
    upside_down: bool
    # The same for its direction, degrees.
    within_deg: float
    # Within which it is with 95 %, m.
    within_m: float
    # Its place, m, and direction, degrees.
    x: float
    # See x.
    y: float
    # See x.
    yaw_deg: float


class CalibrationPair(TypedDict):
    """A pair of modules."""

    # How long they have seen the walker together, s.
    common_s: float
    # Their names.
    modules: list[str]
    # How long they should, s.
    needed_s: float
    # How far apart they see the walker, m; after finish.
    residual_m: float | None


class CalibrationPlace(TypedDict):
    """A place as a walker finds it."""

    # On which side of it.
    side: CalibrationSide
    # Steps from the module, at least one.
    steps: int


class CalibrationQuality(TypedDict):
    """How good the whole is, and by which figures."""

    # How far apart two modules see the walker, m: median of the pairs.
    apart_m: float
    # In a word.
    grade: CalibrationGrade
    # Length of wall that two of them see and that fits, too, m; null if it is too short to help.
    wall_m: float | None
    # Within which the worst of them is with 95 %, m.
    within_m: float


# Why nothing was found.
CalibrationRefusal = TypedDict(
    "CalibrationRefusal",
    {
        "is": "Literal['alone', 'apart', 'apart-floor', 'short', 'short-floor', 'narrow', 'narrow-floor', 'contradiction', 'vague', 'unsolved', 'site-changed']",
        # Its name.
        "module": "NotRequired[str]",
        # How long they did, s.
        "common_s": "NotRequired[float]",
        # How long they should, s.
        "needed_s": "NotRequired[float]",
        # One of them.
        "one": "NotRequired[str]",
        # The other.
        "other": "NotRequired[str]",
        # How far the walk spreads about its middle, m.
        "spread_m": "NotRequired[float]",
        # The share of the walk that does.
        "share": "NotRequired[float]",
        # The same for its direction, degrees.
        "within_deg": "NotRequired[float]",
        # Within which it is with 95 %, m.
        "within_m": "NotRequired[float]",
    },
)

# On which side of a module a place is.
CalibrationSide = Literal["ahead", "ahead-left", "ahead-right", "left", "right"]


class CalibrationStatus(TypedDict):
    """How far it is."""

    # Whether a calibration has begun.
    active: bool
    # What to do now, in words.
    advice: str
    # The same, for pages that say it in another language; null before it has begun.
    advice_is: CalibrationAdvice | None
    # For how long several people were in view; those moments are not used, s.
    crowded_s: float
    # Whether the guide says that it is enough.
    enough: bool
    # What was found, after finish.
    found: CalibrationFound | None
    # Every pair that has seen the walker together.
    pairs: list[CalibrationPair]
    # A place to go to, in the site as it was before.
    place: list[float] | None
    # How much of what is needed is there, 0 to 1.
    progress: float
    # Why nothing was found, after finish.
    refused: str | None
    # The same, for pages that say it in another language.
    refused_is: CalibrationRefusal | None
    # Modules that see the walker now.
    sees: list[str]
    # How long ago, s.
    since_s: float


class CalibrationStep(TypedDict):
    """A step of a calibration."""

    # Which.
    do: CalibrationDo


# A card or a tag, as a hash that only this site can make: the number on it is never kept.
Card = str


class Conflict(TypedDict):
    """A part that both have changed, each in another way."""

    # Its place in the merged site, which has mine there, or theirs if mine is none.
    index: int
    # What it is.
    kind: Kind
    # What people call it.
    label: str
    # What I made of it; null: I took it away.
    mine: Any
    # What they made of it; null: they took it away.
    theirs: Any


# Whether the leaf is shut.
Contact = Literal["open", "shut"]


class Count(TypedDict):
    """How many people were in a zone from some time on."""

    # ms since 1970.
    at_ms: int
    # People; none where that is not known.
    count: int | None
    # How far that can be trusted.
    state: ZoneKnown
    # Its name.
    zone: str


# A line across which people are counted.
CountingLine = TypedDict(
    "CountingLine",
    {
        # Where it begins.
        "from": "list[float]",
        # Its name.
        "name": "str",
        # Where it ends. *In* is to the left of the way from one to the other.
        "to": "list[float]",
    },
)


class Coverage(TypedDict):
    """A grid of which modules see what."""

    # What is seen by the same modules, the largest first.
    areas: list[CoverageArea]
    # Side of a cell, m.
    cell_m: float
    # Cells in a row.
    columns: int
    # The area of each cell, row by row, from the lowest: 0 is seen by no module, 1 is the first of areas.
    seen_by: list[int]
    # Square metres seen by at least one, and by at least two modules.
    seen_m2: list[float]
    # Lower left corner.
    x: float
    # Lower left corner.
    y: float


class CoverageArea(TypedDict):
    """What is seen by the same modules."""

    # How large it is, m².
    m2: float
    # Their names, in the order of the site; at least one.
    modules: list[str]


class Covered(TypedDict):
    """What the modules see, and what is expected of them."""

    # All zones together.
    all: Share
    # What no module sees, the largest first.
    blind: list[Spot]
    # Side of a cell, m.
    cell_m: float
    # Middle of each cell, and what sees it: 0 nothing, 1 one module or several on one side, 2 modules on two sides.
    cells: list[list[float | int]]
    # What is expected by how much is seen alone, of rooms that were simulated before; empty: none of them is like this site.
    estimated: list[Expectation]
    # What the simulator expects; null: it was not asked.
    expected: Expected | None
    # Where one more module would help most; none where it would not, or no module is heard whose like it could be.
    next: Next | None
    # Where modules were moved to when, the newest first; null without a database.
    poses: list[Posed] | None
    # When this was found.
    unix_ms: int
    # Each zone.
    zones: list[Share]


# A counting line in a frame.
CrossedLine = TypedDict(
    "CrossedLine",
    {
        # Inward; none if it was never seen.
        "in": "int | None",
        # As the site calls it.
        "name": "str",
        # Outward; none if it was never seen.
        "out": "int | None",
        # Whether it is seen now.
        "state": "ZoneKnown",
        # Tracks that were not followed since the start, as there were too many near it at once; they may have crossed uncounted.
        "unfollowed": "NotRequired[int]",
        # For how long it was not known since the start, s.
        "unknown_s": "float",
    },
)


class DeviceCondition(TypedDict):
    """The condition at a device."""

    # What the alarm is decided on there; null where it cannot ring: of that device nothing is measured for it.
    condition: AlarmCondition | None
    # As the site calls it.
    device: str


# What a device did.
DeviceEvent = Literal[
    "learn-started",
    "learned",
    "learn-restarted",
    "absorbed",
    "background-forgotten",
    "background-drifted",
    "settings-changed",
    "restarting",
    "address-unusable",
    "address-returned",
    "address-default",
    "factory-reset",
    "keys-set",
    "image-on-trial",
    "image-confirmed",
    "image-reverted",
    "image-forged",
    "image-damaged",
    "image-other",
    "image-too-old",
    "unknown",
]

# What a device is doing.
DeviceState = Literal["missing", "found", "searching", "learning", "watching", "storing"]


class Done(TypedDict):
    """It is done, and there is nothing to say of it."""


class Door(TypedDict):
    """A door."""

    # Longest time from the card to the number, s.
    ask_s: float
    # Longest time a number is compared with the count before it is asked again, s.
    check_s: float
    # Longest time from the lock to a leaf that is shut, s; then it is held open.
    close_s: float
    # How long the door stays open for a person who wants out, s.
    exit_s: float
    # What the lock does in trouble.
    fail: Fail
    # The line across which people go in, in either direction.
    line: list[list[float]]
    # Its name.
    name: str
    # And for each further one, s.
    next_s: float
    # How long the door stays unlocked for the first of a group, s.
    pass_s: float
    # A card that went in is not taken again for so long, s.
    passback_s: float
    # Most people who may enter at once.
    people_max: int
    # Where cards are shown; the middle of the line, by default.
    reader: NotRequired[list[float] | None]
    # Numbers that may be tried with one card.
    tries_max: int
    # Also modules without a key are believed: their reports can be forged.
    without_keys: NotRequired[bool]
    # The zone before it, in which people are counted.
    zone: str


# Why there is an alarm.
DoorAlarm = Literal["followed", "ran-in", "turned-back", "passed-back", "went-in", "held-open", "trouble"]


class DoorLine(TypedDict):
    """The state of a door, for every client that shows it."""

    # Why there is an alarm, if there is one.
    alarm: DoorAlarm | None
    # Number of that output.
    alarm_id: int
    # Whether the alarm has taken it.
    alarm_taken: bool
    # Whether the leaf is shut; none: not reported yet.
    contact: Contact | None
    # The number entered last.
    entered: int
    # What the lock is to be.
    lock: Lock
    # Number of that output, and whether the lock has taken it.
    lock_id: int
    # Whether the lock has taken it.
    lock_taken: bool
    # Its name.
    name: str
    # Which track showed which card, so probably.
    names: NotRequired[list[DoorName]]
    # Counts passages.
    passage: int
    # Most people who may be entered.
    people_max: int
    # Where it is.
    phase: Phase
    # The same, in words.
    prompt: str
    # What the entrant is to do, for programs.
    prompt_name: DoorPrompt
    # While it has failed: the alarm that stands beneath, and goes on after that.
    standing: NotRequired[DoorAlarm | None]
    # How many have gone through.
    through: int
    # Numbers that may still be tried.
    tries_left: int
    # What is wrong, while it has failed.
    trouble: DoorTrouble | None


class DoorName(TypedDict):
    """A track and a card."""

    # The first digits of the card's hash.
    label: str
    # How likely they belong together, 0 to 1.
    likelihood: float
    # The track.
    track: int


# What the entrant is to do.
DoorPrompt = Literal[
    "starting",
    "ready",
    "how-many",
    "counting",
    "go-in",
    "closing",
    "let-shut",
    "out-of-order",
    "called",
    "not-seen",
    "count-again",
    "stand-apart",
    "begin-again",
]


class DoorRead(TypedDict):
    """A door."""

    # Longest time from the card to the number, s.
    ask_s: NotRequired[float]
    # Longest time a number is compared with the count before it is asked again, s.
    check_s: NotRequired[float]
    # Longest time from the lock to a leaf that is shut, s; then it is held open.
    close_s: NotRequired[float]
    # How long the door stays open for a person who wants out, s.
    exit_s: NotRequired[float]
    # What the lock does in trouble.
    fail: Fail
    # The line across which people go in, in either direction.
    line: list[list[float]]
    # Its name.
    name: str
    # And for each further one, s.
    next_s: NotRequired[float]
    # How long the door stays unlocked for the first of a group, s.
    pass_s: NotRequired[float]
    # A card that went in is not taken again for so long, s.
    passback_s: NotRequired[float]
    # Most people who may enter at once.
    people_max: NotRequired[int]
    # Where cards are shown; the middle of the line, by default.
    reader: NotRequired[list[float] | None]
    # Numbers that may be tried with one card.
    tries_max: NotRequired[int]
    # Also modules without a key are believed: their reports can be forged.
    without_keys: NotRequired[bool]
    # The zone before it, in which people are counted.
    zone: str


class DoorState(TypedDict):
    """A door, and its last passages."""

    # Why there is an alarm, if there is one.
    alarm: DoorAlarm | None
    # Number of that output.
    alarm_id: int
    # Whether the alarm has taken it.
    alarm_taken: bool
    # Whether the leaf is shut; none: not reported yet.
    contact: Contact | None
    # The number entered last.
    entered: int
    # What the lock is to be.
    lock: Lock
    # Number of that output, and whether the lock has taken it.
    lock_id: int
    # Whether the lock has taken it.
    lock_taken: bool
    # Its name.
    name: str
    # Which track showed which card, so probably.
    names: NotRequired[list[DoorName]]
    # Counts passages.
    passage: int
    # The last passages, newest first.
    passages: list[Passed]
    # Most people who may be entered.
    people_max: int
    # Where it is.
    phase: Phase
    # The same, in words.
    prompt: str
    # What the entrant is to do, for programs.
    prompt_name: DoorPrompt
    # While it has failed: the alarm that stands beneath, and goes on after that.
    standing: NotRequired[DoorAlarm | None]
    # How many have gone through.
    through: int
    # Numbers that may still be tried.
    tries_left: int
    # What is wrong, while it has failed.
    trouble: DoorTrouble | None
    # This machine's time, ms since 1970: for senders to set their stamps by.
    unix_ms: int


# Why a door does not know what happens.
DoorTrouble = Literal["starting", "no-frames", "module-lost", "no-key", "unseen", "site-changed"]


class Drops(TypedDict):
    """Datagrams that were not used, by cause."""

    # From the future: begun later than AHEAD_S after it arrived.
    ahead: int
    # In clear, in the name of a device that has a key.
    clear: int
    # An exchange of times that cannot be, or that contradicts the ones before.
    clock: int
    # The device's clock, setup or geometry is not known yet.
    early: int
    # In the name of a device that answers at another address.
    foreign: int
    # Sealed, but not by the holder of the key, or changed on the way, or of a session that is over.
    forged: int
    # A report whose number is far from those of the row that goes on.
    jump: int
    # A device refuses the site's key.
    key: int
    # Older than LATE_S.
    late: int
    # Came before.
    repeated: int
    # Sealed, and taken before.
    replayed: int
    # Of one of two devices that have the same place in the site.
    same_name: int
    # From a start of the device that is over.
    stale_boot: int
    # An answer to nothing that was asked.
    unasked: int
    # The device has no place in the site.
    unplaced: int
    # Not a device's datagram, or not a version understood.
    unreadable: int


class DwellLine(TypedDict):
    """How long people have stayed in a zone, since the start."""

    # How many were at most as long as each of BOUNDS_S, and longer than the bound before; longer ones are in none.
    parts: list[int]
    # Stays that have ended.
    stays: int
    # All of them together, s.
    sum_s: float
    # The zone.
    zone: str


class Entry(TypedDict):
    """A line across which people come and go."""

    # Its ends, in either direction.
    line: list[list[float]]
    # Its name.
    name: str
    # The zone it leads to; by default the only one that counts.
    zone: str | None


class EntryRead(TypedDict):
    """A line across which people come and go."""

    # Its ends, in either direction.
    line: list[list[float]]
    # Its name.
    name: str
    # The zone it leads to; by default the only one that counts.
    zone: NotRequired[str | None]


class Event(TypedDict):
    """Something that happened."""

    # ms since 1970.
    at_ms: int
    # What.
    kind: EventKind
    # The alarm or the state, if the event is about one that this version knows.
    name: NotRequired[EventName | None]
    # Zone, module or door.
    subject: str
    # In words.
    text: str
    # The track, if the event is about one.
    track: int | None


# enter, leave, alarm, cleared, state, passage, door-alarm, restored, discarded, set-aside, raw, what a device has done, or a kind of another version.
EventKind = str


class EventLine(TypedDict):
    """Something that a module did: with its background, its settings or itself."""

    # Since then, s.
    ago_s: float
    # In which of its starts.
    boot: int
    # What it did.
    kind: DeviceEvent
    # Counts the events of that start, from 1.
    number: int
    # What it is, in words, and which host asked for it, if one did.
    text: str


class Exclude(TypedDict):
    """An area in which no person is counted and no track begins: of shelves, machines, a neighbour's ground."""

    # Its name.
    name: str
    # Its corners, at least three.
    polygon: list[list[float]]


class ExcludeRead(TypedDict):
    """An area in which no person is counted and no track begins: of shelves, machines, a neighbour's ground."""

    # Its name.
    name: NotRequired[str]
    # Its corners, at least three.
    polygon: list[list[float]]


class Expectation(TypedDict):
    """What is to be expected with so many people."""

    # In the best of them.
    best: float
    # Share of the time in which the count is right, on the mean of the layouts that are like this one.
    exact: float
    # How many they are.
    layouts: int
    # So many people in the zones together.
    people: int
    # In the worst of them.
    worst: float


class Expected(TypedDict):
    """What the simulator expects of this site."""

    # Share of the time in which the count is right, and its interval at 95 %.
    exact: float
    exact_95: list[float]
    # Whether the modules stood where they are now.
    is_of_now: bool
    people: int
    runs: int


class Explained(TypedDict):
    """The reasons."""

    # Alarms of that name: those that stand, and those of the last day.
    listed: NotRequired[list[ListedAlarm] | None]
    # In words, a sentence each.
    words: list[str]


# What the lock does when it is unknown what happens at the door.
Fail = Literal["secure", "safe"]


class FiguresBin(TypedDict):
    """A part of the time."""

    # When it begins, ms since 1970.
    from_ms: int
    # Each counting line, by its name.
    lines: dict[str, LineFigures]
    # When it ends.
    to_ms: int
    # Each zone, by its name.
    zones: dict[str, ZoneFigures]


class FiguresKept(TypedDict):
    """Something that is kept."""

    # The bins.
    bins: list[FiguresBin]
    # There is a database.
    kept: Literal[True]


class FirmwareFile(TypedDict):
    """A file that is handed out."""

    # The board; null: it is of none.
    board: str | None
    # Its length.
    bytes: int
    # Its name.
    name: str
    # What it is for.
    purpose: Purpose


class FirmwareFiles(TypedDict):
    """All that is handed out."""

    # Whether the boot loaders take updates signed with the development key, whose secret everybody has; null: not known.
    development_key: bool | None
    # Board by board.
    files: list[FirmwareFile]
    # Where on the tracker's machine they lie.
    folder: str


class Floor(TypedDict):
    """A floor of pressure panels."""

    # Columns.
    columns: int
    # Its name, MAC or instance name.
    name: str
    # Side of a panel.
    pitch_m: float
    # Rows.
    rows: int
    # The outer corner of panel (0, 0).
    x: float
    # The same.
    y: float
    # Where columns go.
    yaw_deg: float


class FloorLine(TypedDict):
    """What a floor of pressure panels shows. Panels are numbered row by row: row · columns + column."""

    # Its columns.
    columns: int
    # Those that never go down.
    dead: NotRequired[list[int]]
    # The panels that are down.
    down: list[int]
    # As the site calls it.
    name: str
    # Those that never come up.
    stuck: NotRequired[list[int]]
    # From this panel on nothing is known: more do not work than a reading names.
    unknown_from: NotRequired[int | None]


class FloorRead(TypedDict):
    """A floor of pressure panels."""

    # Columns.
    columns: int
    # Its name, MAC or instance name.
    name: str
    # Side of a panel.
    pitch_m: NotRequired[float]
    # Rows.
    rows: int
    # The outer corner of panel (0, 0).
    x: float
    # The same.
    y: float
    # Where columns go.
    yaw_deg: NotRequired[float]


class Frame(TypedDict):
    """What is known at one time."""

    # Every alarm that stands, of the tracker itself, of modules and of doors, the oldest first.
    alarms: NotRequired[list[ListedAlarm]]
    # Every guarded door of the site.
    doors: NotRequired[list[DoorLine]]
    # Datagrams of modules that were not used, since the start.
    dropped: Drops
    # How long people have stayed in each zone, since the start.
    dwell: NotRequired[list[DwellLine]]
    # Every floor of pressure panels that is read.
    floors: NotRequired[list[FloorLine]]
    # HTTP connections and requests that were refused or ended, since the start.
    http: HttpRefused
    # Every counting line of the site.
    lines: NotRequired[list[CrossedLine]]
    # Snapshots that the database, MQTT or another sink did not get, as it had fallen behind, since the start.
    missed: int
    # Every module of the site, and every one that was found beside them.
    modules: list[ModuleLine]
    # Every ID that was read within the last hour, and which tracks it may be.
    names: NotRequired[list[NameLine]]
    # Datagrams that were dropped as the tracker had fallen behind, since the start.
    overrun: int
    # Announced devices that were not asked, or are no longer known, since the start.
    refused: Refused
    # Signs since the start, by what became of them.
    signs: SignCounts
    # Datagrams from addresses that are no device of ours, since the start.
    strangers: int
    # Time the states are predicted to, s.
    t: float
    # How many people are in the whole site.
    total: Total
    # All tracks, tentative ones included.
    tracks: list[TrackLine]
    # Milliseconds since 1970 when it was made, by this machine's clock: for people and databases, never for computing.
    unix_ms: int
    # What is known of each zone, by its name.
    zones: dict[str, ZoneLine]


class HeatKept(TypedDict):
    """Something that is kept."""

    # Side of a cell, m.
    cell_m: float
    # Time of each, s, row by row from the lowest; null: no person was seen there, and no module that sees it was watching.
    cells: list[float | None]
    # Cells in a row.
    columns: int
    # Time of people who were hidden, and of those outside the cells, s.
    hidden_s: float
    # There is a database.
    kept: Literal[True]
    outside_s: float
    # Rows.
    rows: int
    # How long each module was watching, s.
    watched: dict[str, int]
    # Lower left corner, m.
    x: float
    # Lower left corner, m.
    y: float


class HttpRefused(TypedDict):
    """HTTP connections and requests that were refused or ended, by cause."""

    # An address had its share of the places.
    address: int
    # The body of a request did not come in time.
    body: int
    # The host or the page that asked is not allowed.
    foreign: int
    # All places for connections were taken.
    full: int
    # No whole header of a request came in time; a connection that was kept open for nothing is one of these.
    header: int
    # Passwords were tried too often.
    often: int
    # Who asked may not do this.
    role: int
    # No TLS could be agreed, or a request came without it.
    tls: int
    # Who asked is not known, or the password was wrong.
    unknown: int
    # A client did not take what it was sent, or did not answer.
    unread: int


class Identify(TypedDict):
    """How long to blink."""

    # For so many seconds, 60 at most; 0: no more; without it, half a minute.
    seconds: NotRequired[int]


class Inside(TypedDict):
    """A track that may be in a zone."""

    # Whether its mean is inside: else it is at the edge, and not counted here.
    is_inside: bool
    # Probability that it is there at all and inside.
    probability: float
    # What it is to the count.
    role: Role
    # Its number.
    track: int


# What a part of a site is.
Kind = Literal["module", "floor", "wall", "zone", "entry", "line", "mover", "exclude", "door", "reader"]


class Learn(TypedDict):
    """How to learn."""

    # Scans to learn from; 0: as many as its setting says.
    scans: NotRequired[int]


# Why a track exists.
Life = TypedDict(
    "Life",
    {
        "is": "Literal['seen', 'hidden', 'tentative', 'unexplained', 'part']",
        # That track.
        "of": "NotRequired[int]",
    },
)

# Where a track is in its life.
LifeCycle = Literal["tentative", "confirmed", "occluded"]


class Likelihood(TypedDict):
    """A track that may be the one of an ID."""

    # How probable that is, 0 to 1.
    probability: float
    # The track.
    track: int


# A line within a bin.
LineFigures = TypedDict(
    "LineFigures",
    {
        # Inward; none if no person was seen to cross and the line was not seen all the time.
        "in": "int | None",
        # Outward; none if no person was seen to cross and the line was not seen all the time.
        "out": "int | None",
        # For how long not all of the line was seen, s.
        "unknown_s": "float",
    },
)


class ListedAlarm(TypedDict):
    """An alarm, as it is listed and written."""

    # Who has acknowledged it; absent until then.
    acknowledged: NotRequired[Acknowledged | None]
    # Its number: another each time it begins.
    id: int
    # Why, for programs.
    name: AlarmName
    # The name of the device, door or zone.
    of: NotRequired[str]
    # How much that takes away.
    severity: Severity
    # When it began, ms since 1970.
    since_ms: int
    # What it is about.
    source: About
    # What it is and what to do, in words.
    text: str
    # When it ended, ms since 1970; absent while it stands.
    until_ms: NotRequired[int | None]


# What the lock is to be. It inhibits entry only: from inside the handle always opens.
Lock = Literal["locked", "unlocked", "exit"]


class LockOrder(TypedDict):
    """What the lock is to be, and for how long."""

    # It locks by itself after so long, ms, if it is told nothing more. None: until the next order.
    for_ms: NotRequired[int | None]
    # Number of the output.
    id: int
    # What it is to be.
    lock: Lock
    # The lock's newest number, if it has said one.
    nonce: NotRequired[Nonce | None]


class LogIn(TypedDict):
    """What a user sends to log in."""

    # Their name.
    name: str
    # Their password.
    password: str


class Measured(TypedDict):
    """A figure and its limit."""

    # The alarm's condition holds beyond this.
    limit: float
    # In this unit.
    unit: Unit
    # It is so much.
    value: float


class Module(TypedDict):
    """A module and where it is."""

    # What in its background has the shape of a person and is none: bearing from its front to its left, degrees, and range, m.
    furniture: NotRequired[list[list[float]]]
    # Height of its plane above the floor.
    height_m: float
    # Its name, MAC or instance name.
    name: str
    # Whether its place is known. One that is not placed is asked and calibrated, and nothing that it sees is used.
    placed: NotRequired[bool]
    # Whether it hangs head down: what it has on its left is on its right.
    upside_down: NotRequired[bool]
    # Its place.
    x: float
    # Its place.
    y: float
    # Where its front step points.
    yaw_deg: float


class ModuleLine(TypedDict):
    """How a module is."""

    # Where it answers; empty until it is found.
    address: str
    # What is wrong, worst first.
    alarms: list[AlarmLine]
    # Age of its background, s; absent while it has none.
    background_age_s: float | None
    # Checksum errors on its sensor's line since it started.
    checksum_errors: int
    # How much that scatters, ms; null until it was measured.
    clock_jitter_ms: float | None
    # Its clock minus this machine's, ms; absent until it was measured.
    clock_offset_ms: float | None
    # What it has done within the last minute, oldest first.
    events: NotRequired[list[EventLine]]
    # The version of its firmware; empty until it has said so.
    firmware: NotRequired[str]
    # What its newest scan saw empty, in the site's frame, m: the corners of an area that begins at the module. Empty while it sees nothing. What lies outside is not seen.
    free: NotRequired[list[list[float]]]
    # Its identity, as hexadecimal bytes between colons; empty until it has answered.
    id: str
    # Whether what it says is sealed with a key of the site.
    is_sealed: NotRequired[bool]
    # How much of what it learns from it has, 0 to 1; absent while it does not learn.
    learned_share: NotRequired[float | None]
    # Share of its scans that were lost over the last minute, on whatever part of the way; null if it took none.
    lost_share: float | None
    # As the site calls it, or else as it calls itself.
    name: str
    # Scans a second over the last ten seconds.
    scans_hz: float
    # What stands out in its newest scan, in its own frame, m: of a module that the site has, but not its place.
    sees: NotRequired[list[list[float]]]
    # Since its last datagram, s; absent until there was one.
    silent_s: float | None
    # What it is doing.
    state: DeviceState
    # Where something in its background has the shape of a person, as far as the site does not say that it is furniture: bearing from its front to its left, degrees, and range, m, as Module::furniture has them.
    suspects: NotRequired[list[list[float]]]
    # Share of its beams that could not be judged in the newest report.
    unknown_share: float
    # Since a report of it was used last, s; absent until one was.
    unused_s: NotRequired[float | None]


class ModuleRead(TypedDict):
    """A module and where it is."""

    # What in its background has the shape of a person and is none: bearing from its front to its left, degrees, and range, m.
    furniture: NotRequired[list[list[float]]]
    # Height of its plane above the floor.
    height_m: NotRequired[float]
    # Its name, MAC or instance name.
    name: str
    # Whether its place is known. One that is not placed is asked and calibrated, and nothing that it sees is used.
    placed: NotRequired[bool]
    # Whether it hangs head down: what it has on its left is on its right.
    upside_down: NotRequired[bool]
    # Its place.
    x: float
    # Its place.
    y: float
    # Where its front step points.
    yaw_deg: NotRequired[float]


class ModuleSettings(TypedDict):
    """Settings of a module."""

    # Each by its key, as docs/wire.md has them.
    settings: dict[str, str]


class Mover(TypedDict):
    """An area in which a door leaf, a curtain or a fan moves."""

    # Its name.
    name: str
    # Its corners, at least three.
    polygon: list[list[float]]


class MoverRead(TypedDict):
    """An area in which a door leaf, a curtain or a fan moves."""

    # Its name.
    name: NotRequired[str]
    # Its corners, at least three.
    polygon: list[list[float]]


class NameLine(TypedDict):
    """An ID, and the tracks that may be it."""

    # Since it was read last, s.
    heard_s: float
    # Its first digits.
    label: str
    # Since it was read last at a place that is known, s: its tracks go by that. Absent while it never was.
    read_s: NotRequired[float | None]
    # The likeliest first; empty while it is not known which track it is.
    tracks: list[Likelihood]
    # The zones in which the likeliest is.
    zones: NotRequired[list[str]]


class Next(TypedDict):
    """Where one more module would help most."""

    # Share that would be seen by at least one module then.
    one: float
    # Share that would be seen from two sides.
    two: float
    # Its place.
    x: float
    # Its place.
    y: float
    # Where its front points.
    yaw_deg: float


# A number that a lock makes for each time it says that it is ready, of any sort that does not come again soon.
Nonce = int


class NotKept(TypedDict):
    """The tracker runs without a database."""

    # There is none.
    kept: Literal[False]


class Nothing(TypedDict):
    """Nothing more is to be said."""


class OtherEditor(TypedDict):
    """Another open editor."""

    # The user or program that has it open; null if not known by name.
    name: str | None


class OverviewKept(TypedDict):
    """Something that is kept."""

    # The most people at once in each bin.
    bins: list[int | None]
    # What happened, without comings and goings.
    events: list[Event]
    # The first time there is something of; absent while the database is empty.
    first_ms: int | None
    # When it begins, ms since 1970.
    from_ms: int
    # There is a database.
    kept: Literal[True]
    # Events there was no room for.
    left_out: int
    # When it ends.
    to_ms: int


class Passage(TypedDict):
    """One group from its card to the lock."""

    # The alarm, if there was one.
    alarm: DoorAlarm | None
    # When the card was shown, s on the doors' own clock, which starts with the program.
    begun_s: float
    # The card; none when a person went in without.
    card: Card | None
    # The count's distribution when the door was unlocked, or when it was refused last.
    count_p: list[float]
    # The door.
    door: str
    # When it was over, on the same clock.
    ended_s: float
    # The number entered last; 0 if none was.
    entered: int
    # Tracks in the zone when the door was unlocked.
    group: list[int]
    # Counts the door's passages since the start, from 1.
    number: int
    # How it ended.
    outcome: PassageOutcome
    # Why, in words.
    reason: str
    # Share of the zone that was seen then.
    seen_share: float
    # Tracks that went through, in order.
    through: list[int]
    # Numbers that were checked.
    tries: int


# How a passage ended.
PassageOutcome = Literal["complete", "fewer", "gave-up", "refused", "alarmed", "held-open", "trouble"]


class Passed(TypedDict):
    """A passage, with its time of day."""

    # ms since 1970.
    begun_ms: int
    # ms since 1970.
    ended_ms: int
    # The record.
    passage: Passage


class PastLine(TypedDict):
    """What was known at a time."""

    # How many people were in the whole site, as it was then.
    total: Total
    # All tracks.
    tracks: list[TrackLine]
    # When, ms since 1970.
    unix_ms: int
    # Each zone by its name.
    zones: dict[str, PastZone]


class PastZone(TypedDict):
    """What was known of a zone."""

    # People; null where 0 would say more than is known.
    count: int | None
    # How much of it was seen.
    state: ZoneKnown


class Patch(TypedDict):
    """A part of a zone that is not seen."""

    # A cell near its middle.
    at: list[float]
    # The middles of its cells.
    cells: list[list[float]]
    # That module; none where none reaches it.
    module: str | None
    # When some of it was seen last, s ago; none if never.
    seen_ago_s: float | None
    # Its area, m²; of a line its length, m.
    size: float
    # Why the module does not see it that is nearest to seeing it.
    why: Why


class PathWalked(TypedDict):
    """A track's path."""

    # Where it was: ms since 1970, x mm, y mm, and 1 where it was occluded, else 0.
    places: list[list[int]]
    # The start of the tracker it belongs to; numbers of tracks start again with each.
    run: int
    # The track's number.
    track: int


class PathsKept(TypedDict):
    """Something that is kept."""

    # Counts of zones when they changed, and the one before for each.
    counts: list[Count]
    # What happened.
    events: list[Event]
    # There is a database.
    kept: Literal[True]
    # When the tracker ran: from, to.
    lives: list[list[int]]
    # The path of each track.
    paths: list[PathWalked]


class PersonReasons(TypedDict):
    """Why a track exists, and who sees it."""

    # Where it is.
    at: list[float]
    # When it was detected first, s ago.
    born_ago_s: float | None
    # Where.
    born_at: list[float] | None
    # Probability that a person is there at all.
    existence: float
    # Why it is there.
    life: Life
    # Modules that have detected it, or whose range reaches it; who has seen it last comes first.
    modules: list[Sighting]
    # What happened to it last, in words.
    note: str
    # When any module detected it last, s ago.
    seen_ago_s: float | None
    # Its number.
    track: int
    # The zones it is in.
    zones: list[str]


# Where a door is.
Phase = Literal["idle", "asked", "checking", "unlocked", "closing", "held-open", "alarmed", "failed"]


class PictureLaid(TypedDict):
    """Whether there is one, and where it lies."""

    # Whether there is one.
    picture: bool
    # Where it lies; null: nowhere yet.
    place: Place | None


class Place(TypedDict):
    """Where a picture lies."""

    # See width.
    height: float
    # How large a pixel is, m.
    m_per_px: float
    # Where its upper side goes, counter-clockwise.
    turn_deg: float
    # Its size, pixels.
    width: float
    # Its upper left corner, m.
    x: float
    # See x.
    y: float


# Where a module's pose comes from, by its name in the database.
PoseSource = Literal["file", "map", "calibration"]


class Posed(TypedDict):
    """Where a module was from some time on."""

    # ms since 1970.
    at_ms: int
    # As the site called it.
    module: str
    # Where the pose came from.
    source: PoseSource
    # Its place, m.
    x_m: float
    # m.
    y_m: float
    # Where its front pointed, counter-clockwise.
    yaw_deg: float


class Proposal(TypedDict):
    """Parts that a site lacks."""

    # Gaps through which people come into these rooms.
    entry: list[Entry]
    # Walls.
    wall: list[Wall]
    # Rooms, as zones whose people are counted.
    zone: list[Zone]


# What a file is for.
Purpose = Literal["drive", "debugger", "program", "udev", "sums"]


class Reader(TypedDict):
    """A reader."""

    # Of a camera: pixel (u, v, 1) to a place on the floor, row by row.
    homography: NotRequired[list[float] | None]
    # Its name.
    name: str
    # How far it reads, m.
    reach_m: NotRequired[float | None]
    # Spread of such a place along each axis, m; 0.2 if it is not said.
    sigma_m: NotRequired[float | None]
    # Its place, m, with y and reach_m; or else it has a homography.
    x: NotRequired[float | None]
    # See x.
    y: NotRequired[float | None]


class Refusal(TypedDict):
    """Why something was not done."""

    # In words: what is wrong, where, and what to do.
    error: str


class Refused(TypedDict):
    """Announced devices that were not asked, or are no longer known, by cause."""

    # There were too many: the oldest that had never answered was given up, or the new one.
    crowded: int
    # Devices that answered, and were given up for newer ones.
    forgotten: int
    # Addresses outside the networks of this host.
    outside: int


class Rename(TypedDict):
    """Another name."""

    # It.
    name: str


class Renamed(TypedDict):
    """A module has another name."""

    # Its new name.
    name: str
    # The site's new revision, if the site called it by the old one.
    revision: NotRequired[int | None]


class ReportLine(TypedDict):
    """All tracks, right after a report."""

    # The module of the report, as the site names it.
    module: str
    # The report's number.
    sequence: int
    # When the report had arrived and was used, s on the tracker's clock: that of frames.
    t: float
    # All tracks, as in a snapshot.
    tracks: list[TrackLine]


class Revised(TypedDict):
    """The site has changed."""

    # What was changed meanwhile, and is kept.
    merged: NotRequired[list[str]]
    # Its new revision.
    revision: int


# What a track is to the number of people in a zone.
Role = Literal["counted", "tentative", "unexplained", "part"]


class Session(TypedDict):
    """Who asks, and what the page shows them."""

    # What they may do.
    may: list[str]
    # The user's name, or that of the token; null for a client that is not known.
    name: str | None
    # Whether anybody has to log in here.
    needed: bool
    # Their role; null for programs, which may have several.
    role: str | None
    # The tracker's version; absent for a client that may not look.
    version: NotRequired[str | None]


# How much an alarm takes away; the order is that of the enum, the least first.
Severity = Literal["notice", "degraded", "failed"]


class Share(TypedDict):
    """How much of a zone is seen."""

    # What no module sees, m².
    blind_m2: float
    # Its area, m².
    m2: float
    # Share seen by at least one module.
    one: float
    # Share seen from two sides.
    two: float
    # Its name; of all together empty.
    zone: str


class Sighting(TypedDict):
    """A module, and what it has of a track."""

    # As the site calls it.
    module: str
    # When it detected the track last, s ago; null if never.
    seen_ago_s: float | None
    # Why it does not see it now, where it is believed to be.
    why: Why


class Sign(TypedDict):
    """What a reader has read, and where."""

    # When, ms since 1970; without it, now.
    at_ms: NotRequired[int | None]
    # The ID that was read: 1 to 128 characters, of which only a keyed hash is kept.
    id: str
    # The reader of the site that has read it.
    reader: NotRequired[str | None]
    # Spread of that place along each axis, m.
    sigma_m: NotRequired[float | None]
    # Of a camera: the pixel's column, with v.
    u: NotRequired[float | None]
    # Of a camera: the pixel's row.
    v: NotRequired[float | None]
    # Without a reader: where, m, with y.
    x: NotRequired[float | None]
    # See x.
    y: NotRequired[float | None]


class SignCounts(TypedDict):
    """Signs since the start, by what became of them."""

    # There were too many IDs.
    full: int
    # Read too long ago, or in the future.
    late: int
    # Malformed.
    malformed: int
    # At no place.
    no_place: int
    # Of a reader that the site does not have.
    no_reader: int
    # Used.
    taken: int
    # No tracks were known at their time.
    untracked: int


class Site(TypedDict):
    """Modules with their poses, walls, zones, entries, lines, movers, doors, readers and floors."""

    # Doors that let in as many people as were entered.
    door: NotRequired[list[Door]]
    # Lines across which people come and go.
    entry: list[Entry]
    # Areas in which no person is counted.
    exclude: NotRequired[list[Exclude]]
    # Floors of pressure panels.
    floor: NotRequired[list[Floor]]
    # Lines across which people are counted.
    line: NotRequired[list[CountingLine]]
    # The modules.
    module: list[Module]
    # Areas in which things move that are not people.
    mover: list[Mover]
    # Readers of cards and tags.
    reader: NotRequired[list[Reader]]
    # What stops people, beams or both.
    wall: list[Wall]
    # Areas with a meaning.
    zone: list[Zone]


class SiteChange(TypedDict):
    """Another site."""

    # The site of that revision: with it, what was changed meanwhile is kept.
    base: NotRequired[SiteRead | None]
    # The revision that was read before, so that no edit is lost; without it, whatever is there is replaced.
    revision: NotRequired[int | None]
    # The whole site.
    site: SiteRead


class SiteRead(TypedDict):
    """Modules with their poses, walls, zones, entries, lines, movers, doors, readers and floors."""

    # Doors that let in as many people as were entered.
    door: NotRequired[list[DoorRead]]
    # Lines across which people come and go.
    entry: NotRequired[list[EntryRead]]
    # Areas in which no person is counted.
    exclude: NotRequired[list[ExcludeRead]]
    # Floors of pressure panels.
    floor: NotRequired[list[FloorRead]]
    # Lines across which people are counted.
    line: NotRequired[list[CountingLine]]
    # The modules.
    module: NotRequired[list[ModuleRead]]
    # Areas in which things move that are not people.
    mover: NotRequired[list[MoverRead]]
    # Readers of cards and tags.
    reader: NotRequired[list[Reader]]
    # What stops people, beams or both.
    wall: NotRequired[list[WallRead]]
    # Areas with a meaning.
    zone: NotRequired[list[ZoneRead]]


class SiteShown(TypedDict):
    """The site in use."""

    # Name of its file.
    file: str
    # Counts its changes; to be sent back with an edit, so that none is lost.
    revision: int
    # The site.
    site: Site
    # The text of its file.
    toml: str


class SiteTogether(TypedDict):
    """A change beside what was changed meanwhile."""

    # What was changed meanwhile, in words.
    changes: list[str]
    # What both changed, to be decided.
    conflicts: list[Conflict]
    # Why it was not saved.
    error: NotRequired[str | None]
    # Both in one.
    merged: Site
    # The revision of the site in use.
    revision: int
    # The site in use.
    site: Site
    # What is wrong with it.
    wrong: list[Wrong]


class Spot(TypedDict):
    """A connected part of a zone that no module sees."""

    # A cell near its middle.
    at: list[float]
    # Its area, m².
    m2: float
    # The zone.
    zone: str


class Thing(TypedDict):
    """What stands out from the background, for people."""

    # Its middle, degrees from the module's front, counter-clockwise.
    bearing_deg: float
    # Whether that is long enough to be absorbed.
    is_still: bool
    # How far it is, m.
    range_m: float
    # For how long it has not moved, s.
    still_s: float


class ToClient(TypedDict):
    """What the WebSocket sends. Each message has one key."""

    frame: NotRequired[Frame]
    fields: NotRequired[dict[str, list[list[float]]]]
    report: NotRequired[ReportLine]
    site: NotRequired[int]
    alarms: NotRequired[list[ListedAlarm]]
    editors: NotRequired[list[OtherEditor]]
    error: NotRequired[str]


class Told(TypedDict):
    """What has been told to the webhook, and what it did not take."""

    # Changes that were given up.
    failed: int
    # Changes that it has taken.
    sent: int


class Total(TypedDict):
    """How many people are in the whole site."""

    # People; null where that is not known.
    count: int | None
    # How much of the site's zones is known.
    state: ZoneKnown


class TrackLine(TypedDict):
    """One track."""

    # Covariance of the place: xx, xy, yy in m².
    cov: NotRequired[list[float] | None]
    # Probability that a person is there at all.
    existence: float
    # Never used for another track.
    id: int
    # How it came to be; not written of a track that was seen to come in.
    origin: NotRequired[Origin]
    # Why it is in this state.
    reason: str
    # Where in its life.
    state: LifeCycle
    # m/s.
    vx: float
    # m/s.
    vy: float
    # m.
    x: float
    # m.
    y: float


# What a figure is measured in.
Unit = Literal["silent-s", "damaged-share", "covered-deg", "scans-hz", "clock-s", "missing-share"]

# Why so much is known of a zone.
Verdict = TypedDict(
    "Verdict",
    {
        "is": "Literal['seen', 'begins', 'moved', 'hardly-seen', 'partly-seen', 'not-found-again', 'left-unseen', 'may-hide']",
        # s.
        "for_s": "NotRequired[float]",
        # That room, m².
        "m2": "NotRequired[float]",
    },
)


class Wall(TypedDict):
    """A wall: a line of straight pieces."""

    # What it stops.
    blocks: list[Blocks]
    # Beams do not end at it but go on as its image shows.
    mirror: bool
    # Its corners, at least two.
    points: list[list[float]]


class WallRead(TypedDict):
    """A wall: a line of straight pieces."""

    # What it stops.
    blocks: NotRequired[list[Blocks]]
    # Beams do not end at it but go on as its image shows.
    mirror: NotRequired[bool]
    # Its corners, at least two.
    points: list[list[float]]
    # Site files that earlier maps saved have it; a scene has its own, wall_reflectance.
    reflectance: NotRequired[Any]


class Whereabouts(TypedDict):
    """Where an ID is."""

    # Where its likeliest track is, m; none while there is no such track.
    at: list[float] | None
    # Since it was read last, s.
    heard_s: float
    # Its first digits.
    label: str
    # Where it was read last, m, if that was said.
    read: list[float] | None
    # Since it was read last at a place that is known, s: its tracks go by that. Absent while it never was.
    read_s: NotRequired[float | None]
    # The likeliest first; empty while it is not known which track it is.
    tracks: list[Likelihood]
    # The zones in which the likeliest is.
    zones: NotRequired[list[str]]


# Why a module does not see a place; the order is from what passes by itself to what only another module changes.
Why = TypedDict(
    "Why",
    {
        "is": "Literal['seen', 'person', 'silent', 'not-judged', 'thing', 'wall', 'out-of-view', 'too-far', 'no-module']",
        # Who, if that is a track.
        "track": "NotRequired[int | None]",
    },
)


class Wish(TypedDict):
    """What a browser may ask for."""

    # Whether the editor is open here: a user who may change the site is told which others have it open.
    editing: NotRequired[bool]
    # Whether frames are wanted.
    frames: bool
    # Whether tracks are wanted after each report.
    reports: NotRequired[bool]


class Wrong(TypedDict):
    """Something wrong with a part."""

    # Its number among those.
    index: int
    # Which of its keys; null: its shape, or several.
    key: str | None
    # What the part is.
    kind: Kind
    # A sentence that names the part and what to do.
    text: str


class Zone(TypedDict):
    """An area with a meaning."""

    # People in it are counted.
    count: bool
    # Walls and entries surround it. Where they are drawn all around it need not be said.
    enclosed: bool
    # For how long it stays occupied for automations after the last person, s.
    hold_s: NotRequired[float | None]
    # Its name.
    name: str
    # More people in it than this raise an alarm.
    people_max: NotRequired[int | None]
    # Its corners, at least three.
    polygon: list[list[float]]
    # Unexplained tracks count, too.
    secure: bool


class ZoneFigures(TypedDict):
    """A zone within a bin."""

    # Their median, s; none without any.
    dwell_s: float | None
    # People who entered; none if no person was seen to enter and not all of the zone was known all the time.
    entered: int | None
    # People, the mean over the time in which their number was known; none without such a time, or if that would be 0 and their number was not known all the time.
    mean: float | None
    # The most at once; none likewise.
    most: int | None
    # Stays that ended; none likewise.
    stays: int | None
    # For how long the number of people was not known, s.
    unknown_s: float


# How much of a zone is known.
ZoneKnown = Literal["known", "partly", "unknown"]


class ZoneLine(TypedDict):
    """What is known of a zone."""

    # Number of people found; null where 0 would say more than is known.
    count: int | None
    # Probability of no person, of one, of two, …; null with the count.
    p: list[float] | None
    # Share of the zone that some module sees.
    seen_share: float
    # How much the count can be trusted.
    state: ZoneKnown


class ZoneRead(TypedDict):
    """An area with a meaning."""

    # People in it are counted.
    count: NotRequired[bool]
    # Walls and entries surround it. Where they are drawn all around it need not be said.
    enclosed: NotRequired[bool]
    # For how long it stays occupied for automations after the last person, s.
    hold_s: NotRequired[float | None]
    # Its name.
    name: str
    # More people in it than this raise an alarm.
    people_max: NotRequired[int | None]
    # Its corners, at least three.
    polygon: list[list[float]]
    # Unexplained tracks count, too.
    secure: NotRequired[bool]


class ZoneReasons(TypedDict):
    """Why a zone is as it is."""

    # Side of a cell, m.
    cell_m: float
    # How many are counted in it; null where that is not known, and of a line.
    count: int | None
    # Who may be in it.
    inside: list[Inside]
    # Whether it is a counting line.
    is_line: bool
    # Its name.
    name: str
    # Share of it that is seen.
    seen_share: float
    # Its area, m²; of a line its length, m.
    size: float
    # How much is known.
    state: ZoneKnown
    # What of it is not seen, the largest first.
    unseen: list[Patch]
    # What of it is not seen beside those, m² or m.
    unseen_more: float
    # Why; null of a line.
    verdict: Verdict | None


# Why there is an alarm; by its name in JSON. No two of both kinds have the same.
AlarmName = DoorAlarm | AlarmKind

# What an event is about, by its name.
EventName = AlarmKind | DeviceState

# What the database has of a time, if there is one.
FiguresAnswer = FiguresKept | NotKept

# What the database has of a time, if there is one.
HeatAnswer = HeatKept | NotKept

# How a track came to be, and with that whether it is a person of its own.
Origin = Literal["entered", "unexplained"] | dict[str, int]

# What the database has of a time, if there is one.
OverviewAnswer = OverviewKept | NotKept

# What the database has of a time, if there is one.
PathsAnswer = PathsKept | NotKept
