// What is said of a module: `deno test --allow-read`.

import { aboutModule } from "./details.js";
import { say } from "./words.js";

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
