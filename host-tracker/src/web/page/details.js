// What is known about the chosen module or person, as a table in the panel.

import { alarmText } from "./alarm-words.js";
import { html, isPlaced, measured } from "./shapes.js";
import { age, ago, centimetres, degrees, metres, number, percent, say, word } from "./words.js";

export class Details {
  /** `close` is called when the visitor closes them. */
  constructor(close) {
    this.close = close;
    this.root = html("section", {
      className: "detail",
      id: "detail",
      hidden: true,
      "aria-label": say("details.label"),
    });
  }

  /** `lines`: modules as they are now; `isNow`: whether that is known. */
  show(site, line, lines, chosen, names, isNow) {
    const key = chosen?.module ?? chosen?.person ?? "";
    if (this.root.dataset.of !== String(key)) {
      this.root.dataset.of = key;
      this.root.hidden = !chosen;
      const close = html("button", {
        className: "close",
        type: "button",
        "aria-label": say("details.close"),
        onclick: () => this.close(),
      }, "×");
      this.body = html("div");
      delete this.root.dataset.text;
      this.root.replaceChildren(
        html(
          "header",
          {},
          html("h2", {}, chosen?.module ?? say("map.person-n", { id: String(chosen?.person) })),
          close,
        ),
        this.body,
      );
    }
    if (!chosen) return;
    const parts = chosen.module
      ? aboutModule(site, lines.find(({ name }) => name === chosen.module), chosen.module, isNow)
      : aboutPerson(line?.tracks.find(({ id }) => id === chosen.person), names.get(chosen.person));
    const text = JSON.stringify(parts);
    if (this.root.dataset.text === text) return;
    this.root.dataset.text = text;
    const rows = parts.rows.flatMap((
      [term, value, lang = ""],
    ) => [html("dt", {}, term), html("dd", lang ? { lang } : {}, value)]);
    this.body.replaceChildren(
      ...parts.alarms.map((alarm) => html("p", { className: "alarm" }, alarm)),
      html("dl", {}, ...rows),
    );
  }
}

/** Rows and alarms of a module; without a line it was not heard, or, unless `isNow`, nothing is known of it. */
export function aboutModule(site, line, name, isNow) {
  const place = (site.module ?? []).find((module) => module.name === name);
  const rows = [];
  if (line) {
    const { background_age_s, clock_offset_ms, silent_s } = line;
    rows.push(
      [say("details.doing"), word("module", line.state)],
      [
        say("details.scans"),
        measured(line, "scans_hz", (hz) => say("details.scans-value", { n: number(hz, 1) })),
      ],
      [say("details.lost"), measured(line, "lost_share", (share) => percent(share))],
      [say("details.checksum"), measured(line, "checksum_errors", (errors) => number(errors))],
      [say("details.unjudged"), measured(line, "unknown_share", (share) => percent(share))],
      [
        say("details.keys"),
        measured(line, "is_sealed", (sealed) => say(sealed ? "details.sealed" : "details.clear")),
      ],
    );
    if (clock_offset_ms != null) {
      const jitter = measured(line, "clock_jitter_ms", (ms) => number(ms, 1));
      rows.push([say("details.clock"), `${number(clock_offset_ms)} ± ${jitter} ms`]);
    }
    rows.push([
      say("details.background"),
      background_age_s == null ? say("details.none-yet") : say("details.old", { age: age(background_age_s) }),
    ], [
      say("details.heard"),
      silent_s == null ? say("details.never") : silent_s < 1.5 ? say("age.now") : ago(silent_s),
    ]);
    if (line.address) rows.push([say("details.address"), line.address]);
    if (line.id) rows.push([say("details.identity"), line.id]);
  }
  if (!isNow) rows.push([say("details.doing"), say("panel.no-news")]);
  rows.push([
    say("details.place"),
    !place
      ? say("details.place-none")
      : isPlaced(place)
      ? `${number(place.x, 2)}, ${metres(place.y)}, ${degrees(place.yaw_deg)}`
      : say("details.place-unknown"),
  ]);
  if (place) {
    rows.push([say("details.plane"), say("details.plane-value", { height: metres(place.height_m) })]);
  }
  const unheard = isNow ? [say("details.unheard")] : [];
  return { alarms: line ? line.alarms.map(alarmText) : unheard, rows };
}

function aboutPerson(track, card) {
  if (!track) return { alarms: [], rows: [[say("details.state"), say("details.gone")]] };
  const rows = [[say("details.state"), word("track", track.state)]];
  // What happened to it last is the tracker's own note.
  if (track.reason) rows.push([say("details.because"), track.reason, "en"]);
  if (card) rows.push([say("details.has"), card]);
  if (track.existence !== undefined) rows.push([say("details.existence"), percent(track.existence)]);
  rows.push([say("details.walks"), `${number(Math.hypot(track.vx, track.vy), 1)} m/s`]);
  if (track.cov) {
    rows.push([say("details.within"), centimetres(2 * Math.sqrt(Math.max(track.cov[0], track.cov[2])))]);
  }
  rows.push([say("details.place"), `${number(track.x, 2)}, ${metres(track.y)}`]);
  return { alarms: [], rows };
}
