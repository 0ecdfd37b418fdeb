// The report of a day, a week or a month: lines, zones, occupancy and where people were; what is not known is hatched.

import { bars, steps } from "./charts.js";
import { bounds as heatBounds, drawHeat, square } from "./heat.js";
import { ask } from "./net.js";
import { key, table } from "./paper.js";
import { planPicture } from "./plan-picture.js";
import { html } from "./shapes.js";
import { who } from "./who.js";
import { age, dateTime, number as digits, say, tell, time as timeText } from "./words.js";

const PERIOD = { DAY: "day", WEEK: "week", MONTH: "month" };
const UNKNOWN_S = 0.5; // less is not told
const HOUR_S = 3600;

const get = (id) => document.getElementById(id);
const two = (number) => String(number).padStart(2, "0");
const dateText = (date) => `${date.getFullYear()}-${two(date.getMonth() + 1)}-${two(date.getDate())}`;
const midnight = (text) => new Date(`${text}T00:00:00`);
const later = (date, days) => new Date(date.getFullYear(), date.getMonth(), date.getDate() + days);

/** The first moment of a period that holds a date, and that of the next, by this browser's calendar. */
export function span(period, date) {
  if (period === PERIOD.MONTH) {
    return [
      new Date(date.getFullYear(), date.getMonth(), 1),
      new Date(date.getFullYear(), date.getMonth() + 1, 1),
    ];
  }
  const first = period === PERIOD.WEEK ? later(date, -((date.getDay() + 6) % 7)) : later(date, 0);
  return [first, later(first, period === PERIOD.WEEK ? 7 : 1)];
}

/** Where bins begin and end: hours of a day, days of more. A day may have 23 or 25 hours. */
export function edges(period, [first, end]) {
  const all = [];
  if (period === PERIOD.DAY) {
    for (let at = first.getTime(); at < end.getTime(); at += 3_600_000) all.push(at);
  } else {
    for (let day = first; day < end; day = later(day, 1)) all.push(day.getTime());
  }
  return [...all, end.getTime()];
}

const label = (period, ms) => {
  const at = new Date(ms);
  return period === PERIOD.DAY ? two(at.getHours()) : timeText(at, { day: "numeric" });
};
const number = (value, places = 0) => value === null || value === undefined ? "–" : digits(value, places);
const time = (s) => s === null ? "–" : age(s);
const share = (bin, unknown_s) => unknown_s * 1000 / Math.max(bin.to_ms - bin.from_ms, 1);

/** What of the state an address says. */
const ASKED = ["period", "date", "of"];
const state = { period: PERIOD.DAY, date: dateText(new Date()), of: "", site: {} };

// Of a day, 23.7 h are not all of it.
const long = (s) => s < HOUR_S ? age(s) : say("report.hours", { n: digits(s / HOUR_S, 1) });
const unknownCell = (s) => [s < UNKNOWN_S ? "" : long(s), "uncertain"];
const legend = (...words) => html("p", { className: "fine" }, ...words, key(), say("report.unknown"));

const columns = (...names) => names.map((name) => say(`column.${name}`));

/** Lines and zones of a time, all bins and the whole. */
function totals(whole) {
  const lines = Object.entries(whole?.lines ?? {}), zones = Object.entries(whole?.zones ?? {});
  return [
    lines.length
      ? html(
        "section",
        {},
        html("h2", {}, say("report.lines")),
        table(
          columns("line", "in", "out", "unknown"),
          lines.map(([name, line]) => [name, number(line.in), number(line.out), unknownCell(line.unknown_s)]),
        ),
      )
      : "",
    zones.length
      ? html(
        "section",
        {},
        html("h2", {}, say("report.zones")),
        table(
          columns("zone", "entered", "stays", "dwell", "mean", "most", "unknown"),
          zones.map(([name, zone]) => [
            name,
            number(zone.entered),
            number(zone.stays),
            time(zone.dwell_s),
            number(zone.mean, 1),
            number(zone.most),
            unknownCell(zone.unknown_s),
          ]),
        ),
      )
      : "",
  ];
}

function lineSection(name, bins) {
  const own = bins.map((bin) => {
    const line = bin.lines[name];
    return {
      label: label(state.period, bin.from_ms),
      in: line?.in ?? null,
      out: line?.out ?? null,
      share: line ? share(bin, line.unknown_s) : 1,
    };
  });
  const kinds = ["in", "out"].map((one) => ({ key: one, word: say(`column.${one}`) }));
  return html(
    "section",
    { dataset: { of: `line:${name}` } },
    html("h2", {}, say("report.line", { name })),
    bars(say("report.crossings", { name }), own, kinds),
    legend(key("in"), say("column.in"), key("out"), say("column.out")),
  );
}

function zoneSection(name, bins) {
  const own = bins.map((bin) => {
    const zone = bin.zones[name];
    return {
      label: label(state.period, bin.from_ms),
      mean: zone?.mean ?? null,
      most: zone?.most ?? null,
      entered: zone?.entered ?? null,
      dwell: zone?.dwell_s == null ? null : Math.round(zone.dwell_s / 6) / 10,
      share: zone ? share(bin, zone.unknown_s) : 1,
    };
  });
  return html(
    "section",
    { dataset: { of: `zone:${name}` } },
    html("h2", {}, say("report.zone", { name })),
    html("h3", {}, say("report.people-in")),
    steps(say("report.people-of", { name }), own),
    legend(key("in"), say("report.mean"), key("out"), say("report.most")),
    html("h3", {}, say("report.entered")),
    bars(say("report.entered-of", { name }), own, [{ key: "entered", word: say("column.entered") }]),
    html("h3", {}, say("report.dwell")),
    bars(say("report.dwell-of", { name }), own, [{ key: "dwell", word: say("report.median") }]),
  );
}

function heatSection(heat) {
  if (!heat?.kept || !heat.cells.length) return "";
  const limits = heatBounds(heat);
  const keys = limits.at(-1) > 0
    ? limits.flatMap((limit, step) => [key(`heat-${step}`), say("report.heat-key", { age: age(limit) })])
    : [say("report.heat-nobody")];
  const picture = planPicture(state.site, say("report.heat"), (layer, id) => drawHeat(layer, heat, id));
  return html(
    "section",
    { id: "heat" },
    html("h2", {}, say("report.heat")),
    picture,
    legend(...keys),
    html(
      "p",
      { className: "fine" },
      say("report.heat-words", { cell: square(heat.cell_m) }) +
        (heat.hidden_s >= 1 ? say("report.heat-hidden", { age: age(heat.hidden_s) }) : ""),
    ),
  );
}

/** What is shown of all lines and zones. */
function filter() {
  for (const section of document.querySelectorAll("section[data-of]")) {
    section.hidden = Boolean(state.of) && section.dataset.of !== state.of;
  }
}

let asked = 0;
async function load() {
  const number = asked += 1;
  const [first, end] = span(state.period, midnight(state.date));
  const wanted = edges(state.period, [first, end]);
  remember();
  const body = get("report");
  body.setAttribute("aria-busy", "true");
  const range = `from=${first.getTime()}&to=${end.getTime()}`;
  const answers = await Promise.all([
    ask(`/api/figures?edges=${wanted.join(",")}`),
    ask(`/api/figures?edges=${first.getTime()},${end.getTime()}`),
    ask(`/api/heat?${range}`),
  ]).catch((error) => error);
  // Another period was chosen meanwhile.
  if (number !== asked) return;
  body.setAttribute("aria-busy", "false");
  if (answers instanceof Error) {
    const error = html("p", { className: "error" });
    tell(error, answers);
    return body.replaceChildren(error);
  }
  const [figures, whole, heat] = answers;
  const words = { weekday: "long", day: "numeric", month: "long", year: "numeric" };
  const last = new Date(end.getTime() - 1);
  const title = state.period === PERIOD.DAY
    ? timeText(first, words)
    : say("report.range", { from: timeText(first), until: timeText(last) });
  const heading = html("h2", { id: "range" }, title);
  if (!figures.kept) {
    return body.replaceChildren(heading, html("p", {}, say("report.not-kept")));
  }
  if (!figures.bins.length) {
    return body.replaceChildren(heading, html("p", {}, say("report.not-yet")));
  }
  const [all] = whole.bins;
  const names = (kind) => Object.keys(all?.[kind] ?? {});
  choices(names("lines"), names("zones"));
  body.replaceChildren(
    heading,
    html(
      "p",
      { className: "fine" },
      say("report.as-known", { time: dateTime(Date.now()) }),
    ),
    ...totals(all),
    ...names("lines").map((name) => lineSection(name, figures.bins)),
    ...names("zones").map((name) => zoneSection(name, figures.bins)),
    heatSection(heat),
  );
  filter();
}

/** The address names what is shown, beside what else it says, as the language. */
function remember() {
  const said = new URLSearchParams(location.search);
  for (const name of ASKED) said.set(name, state[name]);
  history.replaceState(null, "", `?${said}`);
}

function choices(lines, zones) {
  const all = [
    ["", say("report.all")],
    ...lines.map((name) => [`line:${name}`, say("report.line", { name })]),
    ...zones.map((name) => [`zone:${name}`, say("report.zone", { name })]),
  ];
  if (!all.some(([value]) => value === state.of)) state.of = "";
  get("of").replaceChildren(
    ...all.map(([value, word]) => html("option", { value, selected: value === state.of }, word)),
  );
}

function step(by) {
  const date = midnight(state.date);
  const next = state.period === PERIOD.MONTH
    ? new Date(date.getFullYear(), date.getMonth() + by, 1)
    : later(date, by * (state.period === PERIOD.WEEK ? 7 : 1));
  state.date = get("date").value = dateText(next);
  load();
}

function controls() {
  const change = (name) => (event) => {
    if (!event.target.value) return;
    state[name] = event.target.value;
    load();
  };
  const option = (value) =>
    html("option", { value, selected: value === state.period }, say(`report.${value}`));
  return html(
    "form",
    { className: "controls", onsubmit: (event) => event.preventDefault() },
    html(
      "label",
      {},
      say("report.period"),
      html("select", { id: "period", onchange: change("period") }, ...Object.values(PERIOD).map(option)),
    ),
    html(
      "button",
      { className: "button", type: "button", "aria-label": say("report.before"), onclick: () => step(-1) },
      "‹",
    ),
    html(
      "label",
      {},
      say("report.date"),
      html("input", { type: "date", id: "date", value: state.date, onchange: change("date") }),
    ),
    html(
      "button",
      { className: "button", type: "button", "aria-label": say("report.after"), onclick: () => step(1) },
      "›",
    ),
    html(
      "label",
      {},
      say("report.show"),
      html("select", {
        id: "of",
        onchange: (event) => {
          state.of = event.target.value;
          remember();
          filter();
        },
      }, html("option", { value: "" }, say("report.all"))),
    ),
  );
}

who();
for (const [name, value] of new URLSearchParams(location.search)) {
  if (ASKED.includes(name) && value) state[name] = value;
}
if (Number.isNaN(midnight(state.date).getTime())) state.date = dateText(new Date());
get("print").onclick = () => globalThis.print();
get("content").append(controls(), html("div", { id: "report", "aria-live": "polite" }));
ask("/api/site").then(({ site, file }) => {
  state.site = site;
  get("site-name").textContent = file.replace(/\.toml$/, "");
}).catch(() => {}).then(load);
