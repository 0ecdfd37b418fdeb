// What is known about the chosen module or person, as a table in the panel.

import { MODULE_WORDS, TRACK_WORDS } from "./names.js";
import { html } from "./shapes.js";

const MINUTE_S = 60, HOUR_S = 3600, DAY_S = 86_400;

export const percent = (share) => `${Math.round(share * 100)} %`;

/** A time span in its largest unit of which there are at least one and a half. */
function age(s) {
  if (s < 1.5 * MINUTE_S) return `${Math.round(s)} s`;
  if (s < 1.5 * HOUR_S) return `${Math.round(s / MINUTE_S)} min`;
  if (s < 2 * DAY_S) return `${Math.round(s / HOUR_S)} h`;
  return `${Math.round(s / DAY_S)} days`;
}

export class Details {
  /** `close` is called when the visitor closes them. */
  constructor(close) {
    this.close = close;
    this.root = html("section", { className: "detail", id: "detail", hidden: true, "aria-label": "Details" });
  }

  show(site, line, lines, chosen, names) {
    const key = chosen?.module ?? chosen?.person ?? "";
    if (this.root.dataset.of !== String(key)) {
      this.root.dataset.of = key;
      this.root.hidden = !chosen;
      const close = html("button", {
        className: "close",
        type: "button",
        "aria-label": "Close the details",
        onclick: () => this.close(),
      }, "×");
      this.body = html("div");
      delete this.root.dataset.text;
      this.root.replaceChildren(
        html("header", {}, html("h2", {}, chosen?.module ?? `Person ${chosen?.person}`), close),
        this.body,
      );
    }
    if (!chosen) return;
    const parts = chosen.module
      ? aboutModule(site, lines.find(({ name }) => name === chosen.module), chosen.module)
      : aboutPerson(line?.tracks.find(({ id }) => id === chosen.person), names.get(chosen.person));
    const text = JSON.stringify(parts);
    if (this.root.dataset.text === text) return;
    this.root.dataset.text = text;
    const rows = parts.rows.flatMap(([term, value]) => [html("dt", {}, term), html("dd", {}, value)]);
    this.body.replaceChildren(
      ...parts.alarms.map((alarm) => html("p", { className: "alarm" }, alarm)),
      html("dl", {}, ...rows),
    );
  }
}

function aboutModule(site, line, name) {
  const place = (site.module ?? []).find((module) => module.name === name);
  const rows = [];
  if (line) {
    rows.push(
      ["doing", MODULE_WORDS[line.state] ?? line.state],
      ["scans", `${line.scans_hz.toFixed(1)} a second`],
      ["lost", percent(line.lost_share)],
      ["checksum errors", String(line.checksum_errors)],
      ["beams not judged", percent(line.unknown_share)],
      ["keys", line.is_sealed ? "sealed with the site's key" : "none: in clear"],
    );
    if (line.clock_offset_ms != null) {
      rows.push([
        "clock",
        `${Math.round(line.clock_offset_ms).toLocaleString()} ± ${line.clock_jitter_ms.toFixed(1)} ms`,
      ]);
    }
    rows.push([
      "background",
      line.background_age_s == null ? "none yet" : `${age(line.background_age_s)} old`,
    ], [
      "last heard",
      line.silent_s == null ? "never" : line.silent_s < 1.5 ? "now" : `${age(line.silent_s)} ago`,
    ]);
    if (line.address) rows.push(["address", line.address]);
    if (line.id) rows.push(["identity", line.id]);
  }
  rows.push(
    place
      ? ["place", `${place.x.toFixed(2)}, ${place.y.toFixed(2)} m, ${Math.round(place.yaw_deg)}°`]
      : ["place", "not in the site yet"],
  );
  if (place) rows.push(["plane", `${place.height_m.toFixed(2)} m above the floor`]);
  return {
    alarms: line ? line.alarms.map(({ text }) => text) : ["This module has not been heard."],
    rows,
  };
}

function aboutPerson(track, card) {
  if (!track) return { alarms: [], rows: [["state", "gone"]] };
  const rows = [["state", TRACK_WORDS[track.state] ?? track.state]];
  if (track.reason) rows.push(["because", track.reason]);
  if (card) rows.push(["probably has", card]);
  if (track.existence !== undefined) rows.push(["existence", percent(track.existence)]);
  rows.push(["walks", `${Math.hypot(track.vx, track.vy).toFixed(1)} m/s`]);
  if (track.cov) {
    rows.push(["place within", `${Math.round(200 * Math.sqrt(Math.max(track.cov[0], track.cov[2])))} cm`]);
  }
  rows.push(["place", `${track.x.toFixed(2)}, ${track.y.toFixed(2)} m`]);
  return { alarms: [], rows };
}
