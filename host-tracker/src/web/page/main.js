// The live map: receives frames from the tracker and clicks from the visitor, and passes both to the parts of the page.

import { Calibration } from "./calibrate.js";
import { Drawing } from "./draw.js";
import { Editor } from "./edit.js";
import { LINK, LINK_WORDS } from "./names.js";
import { ask, connect } from "./net.js";
import { Panel } from "./panel.js";
import { Past } from "./past.js";
import { bounds, total } from "./shapes.js";
import { TimeLine } from "./timeline.js";
import { View } from "./view.js";
import { who } from "./who.js";

const TRAIL_FRAMES = 120;
const TRAIL_MS = 12_000;
const FIELDS = 4; // two seconds
const PANEL_MS = 250;
const SPEAK_MS = 5000;

const get = (id) => document.getElementById(id);
const body = document.body.classList;
const state = {
  site: {},
  revision: 0,
  file: "",
  frame: null,
  recent: [],
  fields: [],
  chosen: null,
  link: "",
  fitted: false,
  doors: [],
};

const panel = new Panel(get("panel"), { choose, seek: (at) => time.go(at) });
const past = new Past({
  ready: () => {
    time.ready();
    if (time.at !== null) show();
  },
});
const time = new TimeLine(past, { seek });
const view = new View(get("map"), {
  change: () => redraw(),
  click: (element) => {
    if (body.contains("editing")) return;
    const target = element.closest("[data-module],[data-person]");
    choose(
      !target
        ? null
        : target.dataset.module
        ? { module: target.dataset.module }
        : { person: Number(target.dataset.person) },
    );
  },
  down: (place, event) => editor?.down(place, event),
  move: (place, _event, moved) => editor?.move(place, moved),
  up: (place, event, moved) => editor?.up(place, event, moved),
});
const drawing = new Drawing(get("map"));
const editor = new Editor(drawing.layers.edit, view, {
  change: (site) => drawing.site(site, view.px, null),
  form: (form) => panel.edit(form),
  close: (saved) => {
    body.remove("editing");
    panel.edit(null);
    get("edit-open").hidden = get("calibrate-open").hidden = false;
    get("edit-open").focus();
    saved ? loadSite() : redraw();
  },
});

const calibration = new Calibration(drawing.layers.walk, {
  form: (form) => panel.edit(form),
  close: (saved) => {
    body.remove("calibrating");
    get("edit-open").hidden = get("calibrate-open").hidden = false;
    get("calibrate-open").focus();
    saved ? loadSite() : redraw();
  },
});

function redraw() {
  if (!drawing || !editor) return;
  if (editor.open) {
    drawing.site(editor.site, view.px, null);
    editor.showShapes();
  } else {
    drawing.site(state.site, view.px, state.chosen?.module);
  }
  const metres = [0.5, 1, 2, 5, 10, 20, 50].find((metres) => metres / view.px > 60) ?? 100;
  get("scale").firstElementChild.style.width = `${metres / view.px}px`;
  get("scale").lastElementChild.textContent = `${metres} m`;
  show();
}

/** Shows the newest frame, or the time that the visitor looks back to. */
function show(quick = false) {
  const back = time.at !== null;
  const line = back ? time.lineAt(time.at) : state.frame;
  // The picture stays as it is until the answer for that time is here.
  body.toggle("loading", line === null && back);
  if (line === null && back) return;
  const modules = state.frame?.modules ?? [];
  const trail = back ? time.before(time.at, TRAIL_MS) : state.recent;
  const names = back ? new Map() : panel.where.names(state.frame);
  drawing.tracks(line?.tracks ?? [], trail, state.chosen?.person, names);
  const known = Boolean(line) && !line.noTracker && (back || state.link === LINK.LIVE);
  drawing.panels(state.site, back || !known ? [] : state.frame?.floors ?? []);
  drawing.states(back || !known ? [] : modules, known ? line.zones ?? {} : {});
  if (quick && performance.now() - (show.last ?? 0) < PANEL_MS) return;
  show.last = performance.now();
  const events = back && past.kept ? past.eventsBefore(time.at) : [];
  panel.show({
    site: state.site,
    line,
    alarmed: state.frame?.alarms,
    modules: back ? [] : modules,
    chosen: state.chosen,
    known,
    past: back,
    events,
    doors: state.doors,
    names,
    frame: state.frame,
  });
}

/** Loads the passages of all doors again when a door has changed. */
async function loadDoors(frame) {
  const key = JSON.stringify((frame.doors ?? []).map(({ name, phase, passage }) => [name, phase, passage]));
  if (key === loadDoors.key) return;
  loadDoors.key = key;
  state.doors = (frame.doors ?? []).length ? await ask("/api/door").catch(() => state.doors) : [];
}

/** A link to a time of the map: #at=1700000000000, ms since 1970. */
function jump() {
  const at = Number(/^#at=(\d+)$/.exec(location.hash)?.[1]);
  if (at) time.go(at);
}

function choose(chosen) {
  state.chosen = chosen;
  drawing.fields(state.fields, chosen?.module);
  redraw();
  if (chosen) get("detail").scrollIntoView({ block: "nearest" });
}

function seek(at) {
  body.toggle("past", at !== null);
  body.toggle("jump", at !== null && (!time.playing || time.speed > 5));
  if (at === null && location.hash) history.replaceState(null, "", location.pathname);
  show();
}

async function loadSite() {
  try {
    const answer = await ask("/api/site");
    Object.assign(state, { site: answer.site, revision: answer.revision, file: answer.file });
    get("site-name").textContent = answer.file.replace(/\.toml$/, "");
    time.site = answer.site;
    body.toggle("guarded", (answer.site.door ?? []).length > 0);
    const all = bounds(answer.site);
    if (all && !state.fitted) {
      state.fitted = true;
      view.fit(all);
    }
    if (all) view.bounds = all;
    redraw();
  } catch (error) {
    notice(error.message);
  }
}

function notice(text) {
  get("notice").textContent = text;
  get("notice").hidden = !text;
}

function link(next) {
  state.link = next;
  const live = next === LINK.LIVE;
  get("link").dataset.state = live ? LINK.LIVE : LINK.LOST;
  get("link").lastElementChild.textContent = LINK_WORDS[next];
  body.toggle("lost", !live);
  // Fields of view that were seen are not seen any more.
  if (!live) drawing.fields(state.fields = [], null);
  const since = state.frame ? ` The map shows ${new Date(state.frame.unix_ms).toLocaleTimeString()}.` : "";
  notice(
    live
      ? ""
      : next === LINK.LOST
      ? `Connection lost.${since} Trying again…`
      : `The tracker says nothing.${since}`,
  );
  if (live) loadHistory();
  else show();
  // A session that is over ends the connection.
  if (!live) who();
}

async function loadHistory() {
  // Without it the time line begins now.
  time.load(await ask("/api/history").catch(() => []));
  if (!loadHistory.done) jump();
  loadHistory.done = true;
}

let spoken = { at: 0, total: null };
function speak(frame) {
  const { count } = total(frame, state.site, frame.modules), now = performance.now();
  if (count === spoken.total || now - spoken.at < SPEAK_MS) return;
  spoken = { at: now, total: count };
  get("spoken").textContent = count === null
    ? "number of people not known"
    : `${count} ${count === 1 ? "person" : "people"}`;
}

who();
connect({
  frame: (frame) => {
    if (state.frame && frame.unix_ms < state.frame.unix_ms) state.recent = [];
    state.frame = frame;
    state.recent.push(frame);
    if (state.recent.length > TRAIL_FRAMES) state.recent.shift();
    time.add(frame);
    loadDoors(frame);
    if (time.at === null) show(true);
    speak(frame);
  },
  fields: (fields) => {
    state.fields = [...state.fields.slice(1 - FIELDS), fields];
    drawing.fields(state.fields, state.chosen?.module);
  },
  site: (revision) => {
    if (revision !== state.revision && !editor.open) loadSite();
  },
  link,
});

get("zoom-in").onclick = () => view.zoom(0.75);
get("zoom-out").onclick = () => view.zoom(1.33);
get("zoom-all").onclick = () => view.bounds && view.fit(view.bounds);
get("edit-open").onclick = () => {
  time.seek(null);
  choose(null);
  body.add("editing");
  get("edit-open").hidden = get("calibrate-open").hidden = true;
  editor.start(state);
};
get("calibrate-open").onclick = () => {
  time.seek(null);
  choose(null);
  body.add("calibrating");
  get("edit-open").hidden = get("calibrate-open").hidden = true;
  calibration.start();
};
for (const layer of ["modules", "people"]) {
  drawing.layers[layer].addEventListener("keydown", (event) => {
    if (event.key !== "Enter" && event.key !== " ") return;
    const { module, person } = event.target.dataset;
    event.preventDefault();
    choose(module ? { module } : { person: Number(person) });
  });
}
globalThis.addEventListener("keydown", (event) => {
  if (event.key === "Escape" && !editor.open && state.chosen) choose(null);
});
globalThis.addEventListener("hashchange", jump);
globalThis.addEventListener("beforeunload", (event) => {
  if (editor.open && editor.changed()) event.preventDefault();
});
