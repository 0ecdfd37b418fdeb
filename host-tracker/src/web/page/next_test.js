// How far a site has come, stage by stage: `deno test`.

import { answering, STAGE, stage, strangers, words } from "./next.js";

function equal(found, expected) {
  const [one, other] = [found, expected].map((value) => JSON.stringify(value));
  if (one !== other) throw new Error(`${one} is not ${other}`);
}

const line = (name, more = {}) => ({
  name,
  id: `02:${name}`,
  state: "watching",
  background_age_s: 5,
  alarms: [],
  ...more,
});
const placed = (name) => ({ name, x: 0, y: 0 });
const waiting = (name) => ({ ...placed(name), placed: false });

Deno.test("each stage from nothing to counted people", () => {
  equal(stage({}, []), STAGE.ALONE);
  equal(stage({}, [line("gone", { state: "missing" }), line("10.0.0.7:4040", { id: "" })]), STAGE.ALONE);
  equal(stage({}, [line("left", { state: "found" })]), STAGE.FOUND);
  const two = { module: [waiting("left"), waiting("right")] };
  equal(stage(two, []), STAGE.UNLEARNED);
  equal(stage(two, [line("left"), line("right", { state: "learning" })]), STAGE.UNLEARNED);
  equal(stage(two, [line("left"), line("right", { background_age_s: null })]), STAGE.UNLEARNED);
  equal(stage(two, [line("left"), line("right")]), STAGE.UNPLACED);
  equal(stage({ module: [placed("left")] }, [line("left")]), STAGE.NO_ZONE);
  equal(stage({ floor: [{ name: "mat" }] }, []), STAGE.NO_ZONE);
  equal(stage({ module: [placed("left")], zone: [{ name: "hall" }] }, []), STAGE.READY);
});

Deno.test("a module that comes later is placed before all else", () => {
  const site = { module: [placed("left"), waiting("new")], zone: [{ name: "hall" }] };
  equal(stage(site, [line("left"), line("new")]), STAGE.UNPLACED);
});

Deno.test("strangers are those that answer and have no place, floors neither", () => {
  const site = { module: [placed("left")], floor: [{ name: "mat" }] };
  const lines = [
    line("left"),
    line("mat"),
    line("new", { state: "found" }),
    line("old", { state: "missing" }),
  ];
  equal(strangers(site, lines).map(({ name }) => name), ["new"]);
});

Deno.test("only modules that answer are asked to learn", () => {
  const site = { module: [placed("left"), waiting("new"), waiting("off"), waiting("gone")] };
  const lines = [line("left"), line("new"), line("off", { state: "missing" })];
  equal(answering(site, lines).map(({ name }) => name), ["new"]);
});

Deno.test("each stage but the last has one sentence and one button", () => {
  const sites = [
    [{}, []],
    [{}, [line("left")]],
    [{ module: [waiting("left")] }, []],
    [{ module: [waiting("left")] }, [line("left")]],
    [{ module: [waiting("left"), waiting("right")] }, [line("left"), line("right")]],
    [{ module: [placed("left")] }, []],
  ];
  const said = sites.map(([site, lines]) => words(site, lines));
  equal(said.every(({ title, more, button }) => title && more && button), true);
  equal(new Set(said.map(({ button }) => button)).size, 6);
  equal(words({ module: [placed("left")], zone: [{ name: "hall" }] }, []), null);
});
