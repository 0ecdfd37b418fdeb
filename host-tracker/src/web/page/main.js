// The live map: receives frames from the tracker and clicks from the visitor, and passes both to the parts of the page.

import { Calibration } from "./calibrate.js";
import { setClock } from "./clock.js";
import { DoorMarks } from "./doors.js";
import { Drawing } from "./draw.js";
import { Editor } from "./edit.js";
import { LookBack, named } from "./look-back.js";
import { LINK } from "./names.js";
import { ask, connect } from "./net.js";
import { STAGE, stage } from "./next.js";
import { notice, tellDone } from "./notice.js";
import { Panel } from "./panel.js";
import { Past } from "./past.js";
import { Picture } from "./picture.js";
import { bounds } from "./shapes.js";
import { Showing } from "./showing.js";
import { readSite } from "./site-file.js";
import { speak } from "./spoken.js";
import { Survey } from "./survey.js";
import { TimeLine } from "./timeline.js";
import { Tray } from "./tray.js";
import { View } from "./view.js";
import { who } from "./who.js";
import { clockTime, say } from "./words.js";

const TRAIL_FRAMES = 120;
const FIELDS = 4; // two seconds

const get = (id) => document.getElementById(id);
const body = document.body.classList;
/** What has the map and the panel; the class of the body while it has. */
const MODE = {
  EDITING: "editing",
  CALIBRATING: "calibrating",
  SURVEYING: "surveying",
  LAYING: "laying",
};
let mode = null;
const state = {
  site: {},
  revision: null,
  file: "",
  frame: null,
  recent: [],
  fields: [],
  chosen: null,
  link: "",
  fitted: false,
  doors: [],
};

const past = new Past({
  ready: () => {
    time.ready();
    lookBack.show();
    if (time.at !== null) showing.show();
  },
  failed: (error) => tellDone(error.message),
});
const time = new TimeLine(past, { seek });
const lookBack = new LookBack(time, past, tellDone);
const view = new View(get("map"), {
  change: () => showing.redraw(),
  click: (element) => {
    if (mode) return;
    const why = reason(element);
    if (why) return panel.why.open(why);
    choose(meant(element.closest("[data-module],[data-person],[data-door]")));
  },
  down: (place, event) => editor?.down(place, event),
  move: (place, event, moved) => editor?.move(place, moved, event),
  up: (place, event, moved) => editor?.up(place, event, moved),
  cancel: () => editor?.letGo(),
});
const drawing = new Drawing(get("map"));
const doorMarks = new DoorMarks(drawing.layers.doors);
const panel = new Panel(get("panel"), {
  choose,
  seek: (at) => time.go(at),
  mark: drawing.layers.things,
  unseen: drawing.layers.unseen,
  heat: drawing.layers.heat,
  plan: () => begin(MODE.SURVEYING, survey),
  picture: () => begin(MODE.LAYING, picture),
});
const editor = new Editor(drawing.layers.edit, view, {
  change: (site) => {
    drawing.site(site, view.px, null);
    doorMarks.site(site, view.px, null);
  },
  form: (form) => panel.edit(form),
  present: (open) => present(open),
  close: (said) => {
    panel.edit(null);
    end("edit-open");
    loadSite();
    if (said) tellDone(said);
  },
});

const calibration = new Calibration(drawing.layers.walk, {
  form: (form) => panel.edit(form),
  close: (saved, said) => {
    end("calibrate-open");
    if (said) tellDone(said);
    if (saved) loadSite().then(planned);
  },
  failed: (error) => tellDone(error.message),
});

const survey = new Survey(drawing.layers.survey, {
  form: (form) => panel.edit(form),
  bounds: (corners) => {
    const all = bounds({ ...state.site, wall: [...(state.site.wall ?? []), { points: corners }] });
    if (corners.length && all) view.fit(all);
  },
  close: (saved) => {
    state.fitted &&= !saved;
    end("survey-open");
    if (saved) loadSite();
  },
});

const tray = new Tray(get("tray"), {
  site: (revision) => loadSite(revision),
  walk: () => begin(MODE.CALIBRATING, calibration),
  plan: () => begin(MODE.SURVEYING, survey),
  draw: () => begin(MODE.EDITING, editor),
});

const picture = new Picture(drawing.layers.picture, view, {
  form: (form) => panel.edit(form),
  close: () => {
    end("picture-open");
  },
});

const parts = { drawing, doorMarks, view, editor, picture, time, past, panel, tray };
const showing = new Showing(state, parts);

/** After a walk, what the modules have measured is shown at once if there is nothing to count in yet. */
function planned() {
  if (stage(state.site, state.frame?.modules ?? []) === STAGE.NO_ZONE) {
    begin(MODE.SURVEYING, survey);
  }
}

/** One thing at a time has the map and the panel, from here to `end`. */
async function begin(what, work) {
  // Begun without the site, all that is in it would look like a change of others.
  if (state.revision === null) await loadSite();
  if (mode || state.revision === null) return;
  tellDone.over?.();
  time.seek(null);
  choose(null);
  mode = what;
  body.add(mode);
  get("edit-open").hidden = get("calibrate-open").hidden = true;
  work.start(state);
}

/** The map and the panel are as before; the focus goes where it came from. */
function end(opener) {
  body.remove(mode);
  mode = null;
  get("edit-open").hidden = get("calibrate-open").hidden = false;
  get(opener).focus();
  showing.redraw();
}

/** Loads the passages of all doors again when a door has changed. */
async function loadDoors(frame) {
  const key = JSON.stringify((frame.doors ?? []).map(({ name, phase, passage }) => [name, phase, passage]));
  if (key === loadDoors.key) return;
  loadDoors.key = key;
  state.doors = (frame.doors ?? []).length ? await ask("/api/door").catch(() => state.doors) : [];
}

/** Shows the time that the address names. */
function jump() {
  const at = named(location.hash);
  if (at && !mode) time.go(at);
}

/** What an element of the map stands for. */
function meant(element) {
  const { module, person, door } = element?.dataset ?? {};
  if (module) return { module };
  if (door) return { door };
  return person ? { person: Number(person) } : null;
}

/** The figure on the map that an element is. */
function reason(element) {
  const { zone, line } = element.closest("text.zone-name,.line-group")?.dataset ?? {};
  return zone !== undefined ? { zone } : line !== undefined ? { line } : null;
}

function choose(chosen) {
  state.chosen = chosen;
  panel.why.open(chosen?.person ? { person: chosen.person } : null);
  drawing.fields(state.fields, chosen?.module);
  showing.redraw();
  if (chosen) get(chosen.door ? "door-card" : "detail").scrollIntoView({ block: "nearest" });
}

function seek(at) {
  body.toggle("past", at !== null);
  lookBack.remember(at);
  lookBack.show();
  showing.show();
}

let loading = null;
/** Loads the site, unless it is of this revision already: several say that there is a new one. */
async function loadSite(revision = null) {
  while (loading) await loading;
  if (revision !== null && revision === state.revision) return;
  loading = takeSite();
  await loading;
  loading = null;
}

async function takeSite() {
  try {
    const answer = await readSite();
    Object.assign(state, { site: answer.site, revision: answer.revision, file: answer.file });
    get("site-name").textContent = answer.file.replace(/\.toml$/, "");
    body.toggle("guarded", (answer.site.door ?? []).length > 0);
    const all = bounds(answer.site);
    if (all && !state.fitted) {
      state.fitted = true;
      view.fit(all);
    }
    if (all) view.bounds = all;
    showing.redraw();
    // It may have been opened while this was on its way.
    if (editor.open) editor.told(answer.revision);
  } catch (error) {
    notice(error.message);
  }
}

function link(next) {
  state.link = next;
  const live = next === LINK.LIVE;
  get("link").dataset.state = live ? LINK.LIVE : LINK.LOST;
  get("link").lastElementChild.textContent = say(`link.${next}`);
  body.toggle("lost", !live);
  if (!live) panel.alarms.update(null);
  // Fields of view that were seen are not seen any more.
  if (!live) drawing.fields(state.fields = [], null);
  const since = state.frame ? say("link.shows", { time: clockTime(state.frame.unix_ms) }) : "";
  notice(
    live ? "" : say(next === LINK.LOST ? "link.lost-notice" : "link.silent-notice", { since }),
  );
  if (live) loadHistory();
  else showing.show();
}

async function loadHistory() {
  // Without it the time line begins now.
  time.load(await ask("/api/history").catch(() => []));
  if (!loadHistory.done) jump();
  loadHistory.done = true;
}

who();
picture.load();
const present = connect({
  frame: (frame) => {
    if (state.frame && frame.unix_ms < state.frame.unix_ms) state.recent = [];
    setClock(frame.unix_ms);
    state.frame = frame;
    state.recent.push(frame);
    if (state.recent.length > TRAIL_FRAMES) state.recent.shift();
    panel.alarms.update(frame.alarms ?? []);
    time.add(frame);
    loadDoors(frame);
    if (time.at === null) showing.show(true);
    speak(frame, state.site);
  },
  fields: (fields) => {
    state.fields = [...state.fields.slice(1 - FIELDS), fields];
    drawing.fields(state.fields, state.chosen?.module);
    tray.fields(fields);
  },
  editors: (others) => editor.among(others),
  // A hidden page gets these, and hardly a frame.
  alarms: (standing) => panel.alarms.update(standing),
  site: (revision) => {
    if (editor.open) editor.told(revision);
    else loadSite(revision);
  },
  link,
  // A session that is over ends the connection; a tracker that starts anew knows none, and refuses the next one.
  closed: who,
});

get("zoom-in").onclick = () => view.zoom(0.75);
get("zoom-out").onclick = () => view.zoom(1.33);
get("zoom-all").onclick = () => view.bounds && view.fit(view.bounds);
get("edit-open").onclick = () => begin(MODE.EDITING, editor);
get("calibrate-open").onclick = () => begin(MODE.CALIBRATING, calibration);
/** Enter and the space bar do with an element of a layer what a click does. */
function byKey(layer, does) {
  drawing.layers[layer].addEventListener("keydown", (event) => {
    if (event.key !== "Enter" && event.key !== " ") return;
    event.preventDefault();
    if (!mode) does(event.target);
  });
}
for (const layer of ["modules", "people", "doors"]) byKey(layer, (element) => choose(meant(element)));
byKey("lines", (element) => panel.why.open(reason(element)));
globalThis.addEventListener("keydown", (event) => {
  if (event.key !== "Escape" || editor.open) return;
  if (state.chosen) choose(null);
  else panel.why.open(null);
});
globalThis.addEventListener("hashchange", jump);
/** What is typed and not yet taken in would be lost with the page, which may be closed without another word. */
function leave() {
  editor.leave();
  picture.leave();
}
// A hidden page gets no frames.
document.addEventListener("visibilitychange", () => document.hidden ? leave() : loadHistory());
globalThis.addEventListener("beforeunload", (event) => {
  leave();
  if (editor.open && editor.changed()) event.preventDefault();
});
