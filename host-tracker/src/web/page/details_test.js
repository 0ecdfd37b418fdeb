// What is said of a module: `deno test --allow-read`.

import { aboutModule } from "./details.js";
import { number, percent, say } from "./words.js";

function equal(found, expected) {
  const [one, other] = [found, expected].map((value) => JSON.stringify(value));
  if (one !== other) throw new Error(`${one} is not ${other}`);
}

const site = { module: [{ name: "left", x: 1, y: 2, yaw_deg: 0, height_m: 0.6 }] };

Deno.test("of a module without news it is not said that it was never heard", () => {
  equal(aboutModule(site, undefined, "left", true).alarms, [say("details.unheard")]);
  const { alarms, rows } = aboutModule(site, undefined, "left", false);
  equal([alarms, rows[0][1]], [[], say("panel.no-news")]);
});

Deno.test("a module that is missing has no figures, and one without a figure has a dash", () => {
  const line = {
    name: "left",
    state: "missing",
    scans_hz: 0,
    lost_share: 0,
    checksum_errors: 0,
    unknown_share: 0,
    is_sealed: false,
    clock_offset_ms: null,
    alarms: [],
  };
  const figures = (more) =>
    aboutModule(site, { ...line, ...more }, "left", true).rows.map(([, value]) => value);
  equal(figures({}).slice(1, 6), ["–", "–", "–", "–", "–"]);
  const watching = {
    state: "watching",
    scans_hz: 10,
    lost_share: null,
    clock_offset_ms: 3,
    clock_jitter_ms: null,
  };
  const scans = say("details.scans-value", { n: number(10, 1) });
  equal(figures(watching).slice(1, 7), [scans, "–", number(0), percent(0), say("details.clear"), "3 ± – ms"]);
});
