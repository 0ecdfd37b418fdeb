// How many people are here, and how a module is: `deno test --allow-read`.

import { ABOUT, FAILED, HEALTH, MODULE } from "./names.js";
import { health, isKnown, ofNow, total } from "./shapes.js";

const FRAME = new URL("../../../../docs/schemas/frame.json", import.meta.url);

function equal(found, expected) {
  const [one, other] = [found, expected].map((value) => JSON.stringify(value));
  if (one !== other) throw new Error(`${one} is not ${other}`);
}

const schema = (name) => JSON.parse(Deno.readTextFileSync(FRAME)).$defs[name].oneOf.map((one) => one.const);
const line = (name, state = MODULE.WATCHING) => ({ name, state, alarms: [] });

Deno.test("without zones nobody is counted before a device watches whose place is known", () => {
  const empty = { tracks: [], zones: {} };
  const count = (site, modules) => total(empty, site, modules).count;
  const [placed, waiting] = [{ name: "left" }, { name: "left", placed: false }];
  equal(count({ module: [placed] }, [line("left")]), 0);
  equal(count({ floor: [{ name: "mat" }] }, [line("mat")]), 0);
  equal(count({ module: [placed] }, [line("left", MODULE.MISSING)]), null);
  equal(count({ module: [waiting] }, [line("left")]), null);
  equal(count({ module: [waiting, { name: "gone" }] }, [line("left"), line("gone", MODULE.MISSING)]), null);
  equal(count({}, [line("stranger")]), null);
  // Of the past it is not kept what modules did.
  equal([count({ module: [placed] }, null), count({ module: [waiting] }, null)], [0, null]);
});

Deno.test("a module is as bad as the severity of its alarms says", () => {
  const alarmed = (...severities) => ({
    ...line("left"),
    alarms: severities.map((severity) => ({ name: "of tomorrow", severity })),
  });
  equal(health(alarmed()), HEALTH.GOOD);
  equal(health(alarmed("notice", "degraded")), HEALTH.WARN);
  equal(health(alarmed("notice", FAILED)), HEALTH.BAD);
  equal(schema("Severity").at(-1), FAILED);
});

Deno.test("an alarm is about what the tracker says", () => equal(Object.values(ABOUT), schema("About")));

Deno.test("the newest frame says nothing of now once the connection is lost, nor of the past", () => {
  const frame = { modules: [{ name: "left" }], doors: [{ name: "front" }] };
  const said = (isLive) => ofNow(frame, isKnown(frame, isLive));
  equal(said(true), { ...frame, floors: [], lines: [] });
  equal(said(false), { modules: [], doors: [], floors: [], lines: [] });
  equal(ofNow(null, isKnown(null, true)), said(false));
  equal([isKnown({ noTracker: true }, true), isKnown({ isUnknown: true }, true)], [false, false]);
});
