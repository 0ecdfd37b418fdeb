// What the acceptance form knows by itself: `deno test --allow-read`.

import { known } from "./acceptance.js";
import { percent, say } from "./words.js";

function equal(found, expected) {
  const [one, other] = [found, expected].map((value) => JSON.stringify(value));
  if (one !== other) throw new Error(`${one} is not ${other}`);
}

Deno.test("the loss of a module that was never heard is not said to be none", () => {
  const line = (name, state, lost_share) => ({ name, state, lost_share, alarms: [] });
  const site = { module: [{ name: "left" }, { name: "right" }] };
  const lost = (...modules) => known(site, { modules }, { zones: [] }).lost;
  const none = say("accept.lost-none");
  equal(lost(line("left", "missing", 0)), none);
  equal(lost(line("left", "watching", null)), none);
  equal(
    lost(line("left", "watching", 0.02), line("right", "missing", 1)),
    say("accept.lost-found", { share: percent(0.02, 1), name: "left" }),
  );
});
