// The handover page: what is seen by one module and from two sides, what is not, how each module is, and what would help most.

import { acceptance } from "./acceptance.js";
import { ask } from "./net.js";
import { key, table } from "./paper.js";
import { planPicture } from "./plan-picture.js";
import { html, isPlaced, measured, path, svg } from "./shapes.js";
import { who } from "./who.js";
import {
  age,
  dateTime,
  degrees,
  metres,
  number,
  percent,
  say,
  squareMetres,
  tell,
  time,
  word,
} from "./words.js";

const get = (id) => document.getElementById(id);
const columns = (...names) => names.map((name) => say(`column.${name}`));
const cell = (text, kind = "") => [text, kind];

function picture(site, { cells, cell_m, next }) {
  const half = cell_m / 2;
  const square = ([x, y]) =>
    path([[x - half, y - half], [x + half, y - half], [x + half, y + half], [x - half, y + half]], true);
  const of = (wanted) => cells.filter(([, , seen]) => seen === wanted).map(square).join("");
  return planPicture(site, say("handover.picture"), (layer, id) => {
    layer.append(
      svg("path", { class: "cover-1", d: of(1) }),
      svg("path", { class: "cover-2", d: of(2) }),
      svg("path", { d: of(0), fill: `url(#${id})` }),
    );
    if (next) {
      const { x, y } = next;
      const arm = 0.15;
      layer.append(svg("path", {
        class: "plan-next",
        "stroke-width": 0.06,
        d: path([[x - arm, y], [x + arm, y]]) + path([[x, y - arm], [x, y + arm]]),
      }));
    }
  });
}

function coverage(site, found) {
  const row = (name, { m2, one, two, blind_m2 }) => [
    cell(name),
    cell(squareMetres(m2)),
    cell(percent(one)),
    cell(percent(two)),
    cell(blind_m2 > 0 ? squareMetres(blind_m2) : say("handover.no-blind"), blind_m2 > 0 ? "uncertain" : ""),
  ];
  return html(
    "section",
    { id: "coverage" },
    html("h2", {}, say("handover.seen")),
    table(columns("zone", "area", "one", "two", "blind"), [
      ...found.zones.map((zone) => row(zone.zone, zone)),
      row(say("handover.all"), found.all),
    ]),
    picture(site, found),
    html(
      "p",
      { className: "fine" },
      key("heat-1"),
      say("handover.key-one"),
      key("heat-2"),
      say("handover.key-two"),
      key(),
      say("handover.key-none"),
      ...(found.next ? [say("handover.key-next")] : []),
    ),
    html(
      "p",
      { className: "fine" },
      say("handover.backgrounds"),
    ),
  );
}

function blind(found) {
  const rows = found.blind.map(({ zone, at: [x, y], m2 }) => [
    cell(zone),
    cell(say("handover.around", { x: number(x, 1), y: number(y, 1) })),
    cell(squareMetres(m2)),
  ]);
  return html(
    "section",
    { id: "blind" },
    html("h2", {}, say("handover.blind")),
    rows.length ? table(columns("zone", "where", "size"), rows) : html("p", {}, say("handover.blind-none")),
  );
}

function next({ next, all }) {
  const words = next
    ? say("handover.next-at", {
      x: number(next.x, 2),
      y: number(next.y, 2),
      yaw: degrees(next.yaw_deg),
      one: percent(next.one),
      oneNow: percent(all.one),
      two: percent(next.two),
      twoNow: percent(all.two),
    })
    : say("handover.next-none");
  return html(
    "section",
    { id: "next" },
    html("h2", {}, say("handover.next")),
    html("p", {}, words),
    html(
      "p",
      { className: "fine" },
      say("handover.next-kind"),
    ),
  );
}

/** What the simulator has said of this very site, if it was asked. */
function simulated({ expected }) {
  if (!expected) return [];
  const { people: n, exact, exact_95: [low, high], runs, is_of_now: isOfNow } = expected;
  const words = say("handover.expected", {
    n,
    exact: percent(exact, 1),
    low: number(100 * low, 1),
    high: number(100 * high, 1),
    runs,
  });
  return [
    html(
      "p",
      { className: isOfNow ? "" : "uncertain", id: "expected-here" },
      isOfNow ? words : words + say("handover.elsewhere"),
    ),
  ];
}

/** What is expected of a site of which as much is seen, whatever its walls. */
function estimated({ estimated, all }) {
  if (!estimated.length) {
    return [html("p", { className: "uncertain", id: "expected-none" }, say("handover.estimated-none"))];
  }
  const rows = estimated.map(({ people, exact, worst, best }) => [
    cell(number(people)),
    cell(percent(exact)),
    cell(say("handover.spread", { worst: percent(worst), best: percent(best) })),
  ]);
  const [{ layouts: n }] = estimated, one = percent(all.one), two = percent(all.two);
  return [
    table(columns("people", "exact", "spread"), rows),
    html("p", { className: "fine" }, say("handover.estimated", { n, one, two })),
  ];
}

function expected(found, file) {
  const command = `kehai-sim plan ${file} --keep --modules 0 --people N --json > ${
    file.replace(/\.toml$/, "")
  }.expected.json`;
  return html(
    "section",
    { id: "expected" },
    html("h2", {}, say("handover.exact")),
    ...simulated(found),
    ...estimated(found),
    html("p", { className: "fine" }, say("handover.simulator"), html("code", {}, command)),
  );
}

/** Where a module is, and whether it hangs upside down. */
function placed(module) {
  if (!isPlaced(module)) return say("handover.place-unknown");
  const { x, y, yaw_deg, height_m, upside_down } = module;
  const facts = { x: number(x, 2), y: number(y, 2), yaw: degrees(yaw_deg, 1), height: metres(height_m) };
  const place = say("handover.place", facts);
  return upside_down ? say("handover.hung", { place }) : place;
}

function modules(site, frame) {
  const byName = new Map((frame.modules ?? []).map((line) => [line.name, line]));
  const rows = (site.module ?? []).map((module) => {
    const { name } = module;
    const line = byName.get(name);
    const state = line ? word("module", line.state) : say("handover.unheard");
    const wrong = line ? line.alarms.map((alarm) => word("alarm", alarm.name)).join(", ") : "";
    return [
      cell(name),
      cell(
        wrong ? say("handover.state", { state, alarms: wrong }) : state,
        wrong || !line ? "words uncertain" : "words",
      ),
      cell(measured(line, "scans_hz", (hz) => number(hz, 1))),
      cell(measured(line, "lost_share", (share) => percent(share, 1))),
      cell(line?.background_age_s == null ? "–" : age(line.background_age_s)),
      cell(line?.firmware ?? "–"),
      cell(placed(module)),
    ];
  });
  return html(
    "section",
    { id: "health" },
    html("h2", {}, say("handover.modules")),
    table(columns("module", "state", "scans", "lost", "learned", "firmware", "place"), rows),
  );
}

function changes({ poses }) {
  if (!poses) {
    return html(
      "p",
      { className: "fine" },
      say("handover.no-database"),
    );
  }
  const rows = poses.map(({ at_ms, module, x_m, y_m, yaw_deg, source }) => [
    cell(dateTime(at_ms)),
    cell(module, "words"),
    cell(say("handover.pose", { x: number(x_m, 2), y: number(y_m, 2), yaw: degrees(yaw_deg, 1) })),
    cell(word("source", source), "words"),
  ]);
  return html(
    "section",
    { id: "changes" },
    html("h2", {}, say("handover.changes")),
    rows.length
      ? table(columns("when", "module", "place", "by"), rows)
      : html("p", {}, say("handover.nothing")),
  );
}

async function load() {
  const [{ site, file }, frame, found] = await Promise.all([
    ask("/api/site"),
    ask("/api/state"),
    ask("/api/coverage"),
  ]);
  get("site-name").textContent = file.replace(/\.toml$/, "");
  const at = time(found.unix_ms, { dateStyle: "full", timeStyle: "short" });
  get("content").replaceChildren(
    html("h2", { id: "date" }, at),
    coverage(site, found),
    blind(found),
    next(found),
    expected(found, file),
    modules(site, frame),
    changes(found),
    acceptance(site, frame, found),
  );
}

who();
get("print").onclick = () => globalThis.print();
load().catch((error) => {
  const said = html("p", { className: "error", role: "alert" });
  tell(said, error);
  get("content").replaceChildren(said);
});
