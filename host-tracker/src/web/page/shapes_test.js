// How many people are here, and how a module is: `deno test --allow-read`.

import { ABOUT, FAILED, HEALTH, MODULE, ORIGIN } from "./names.js";
import { health, isKnown, ofNow, people, total } from "./shapes.js";

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

Deno.test("the number of people is what the tracker says, and of the past what it would have said", () => {
  const polygon = [[0, 0], [4, 0], [4, 4], [0, 4]];
  const site = (secure) => ({ zone: [{ name: "hall", polygon, secure }] });
  const track = (id, state, origin) => ({ id, x: id, y: 1, state, ...(origin && { origin }) });
  const tracks = [
    track(1, "confirmed"),
    track(2, "confirmed", { "part-of": 1 }),
    track(3, "tentative", ORIGIN.UNEXPLAINED),
    track(3.5, "tentative"),
  ];
  const line = { tracks, zones: { hall: { count: 1 } } };
  const ids = (secure) => people(line, site(secure)).map(({ id }) => id);
  equal([ids(false), ids(true)], [[1], [1, 3]]);
  equal(total(line, site(false), null), { count: 1, open: [] });
  const said = (count) => total({ ...line, total: { count, state: "partly" } }, site(false), []).count;
  equal([said(7), said(null)], [7, null]);
});

Deno.test("a track came to be as the tracker says", () => {
  const all = JSON.parse(Deno.readTextFileSync(FRAME)).$defs.Origin.oneOf;
  equal(Object.values(ORIGIN), all.filter((one) => one.const).map((one) => one.const));
  equal(Object.keys(all.at(-1).properties), ["part-of"]);
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
