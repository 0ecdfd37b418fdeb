// What is drawn while the tracker is asked, and a drawing that an earlier page has left: `deno test --allow-read`.

import { Draft } from "./edit-draft.js";
import { Editor } from "./edit.js";

function equal(found, expected) {
  const [one, other] = [found, expected].map((value) => JSON.stringify(value));
  if (one !== other) throw new Error(`${one} is not ${other}`);
}

const site = (...names) => ({ zone: names.map((name) => ({ name })) });

/** An editor of a site without a page; `log` has what was kept and how it closed. */
function editor(drawn) {
  const log = [];
  return Object.assign(Object.create(Editor.prototype), {
    site: drawn,
    base: site(),
    saved: JSON.stringify(site()),
    revision: 1,
    file: "home.toml",
    open: true,
    saving: false,
    left: null,
    conflicts: null,
    done: ["undo"],
    kept: {
      forget: () => log.push("forgotten"),
      restore: (_, left) => log.push(left),
    },
    show() {},
    stop: (said) => log.push(`closed ${said}`),
    log,
  });
}

/** Calls `does`, and changes what is drawn before the tracker answers. */
async function meanwhile(answer, change, does) {
  const before = [globalThis.fetch, globalThis.document];
  globalThis.fetch = () => {
    change();
    return Promise.resolve(Response.json(answer.body, { status: answer.status ?? 200 }));
  };
  globalThis.document = { getElementById: () => null };
  try {
    await does();
  } finally {
    [globalThis.fetch, globalThis.document] = before;
  }
}

Deno.test("what is drawn while the changes of others are fetched stays, with its undo", async () => {
  const one = editor(site("mine"));
  const body = {
    revision: 2,
    site: site("theirs"),
    merged: site("mine", "theirs"),
    conflicts: [],
    changes: [],
  };
  await meanwhile({ body }, () => one.site.zone.push({ name: "late" }), () => one.takeIn());
  equal([one.site, one.done, one.newer, one.revision], [site("mine", "late"), ["undo"], true, 1]);
  await meanwhile({ body }, () => {}, () => one.takeIn());
  equal([one.site, one.newer, one.revision], [body.merged, false, 2]);
});

Deno.test("what is drawn while the site is saved stays, and is a change of what was saved", async () => {
  const one = editor(site("mine"));
  await meanwhile({ body: { revision: 2 } }, () => one.site.zone.push({ name: "late" }), () => one.save());
  equal([one.site, one.base, one.revision, one.saving], [site("mine", "late"), site("mine"), 2, false]);
  equal([one.changed(), one.log], [true, []]);
  await meanwhile({ body: { revision: 3 } }, () => {}, () => one.save());
  equal(one.log, ["forgotten", "closed "]);
});

Deno.test("what is drawn while the tracker refuses to save stays", async () => {
  const one = editor(site("mine"));
  const body = { error: "both", revision: 2, site: site(), merged: site("mine"), conflicts: [], changes: [] };
  await meanwhile(
    { body, status: 409 },
    () => one.site.zone.length < 2 && one.site.zone.push({ name: "late" }),
    () => one.save(),
  );
  equal(one.site, site("mine", "late"));
});

/** Calls `does` with the focus in a field of the form, whose value `tells` takes in when the focus leaves it. */
async function typing(tells, does) {
  const before = globalThis.document;
  const field = {
    closest: () => field,
    matches: () => true,
    blur: tells,
    focus: () => field.focused = true,
  };
  globalThis.document = { activeElement: field, getElementById: () => null };
  try {
    await does();
  } finally {
    globalThis.document = before;
  }
  return field;
}

Deno.test("Ctrl+S saves what is being typed, and the field keeps the focus", async () => {
  const one = editor(site("mine"));
  const before = globalThis.fetch, sent = [];
  globalThis.fetch = (_, { body }) => {
    sent.push(JSON.parse(body).site);
    return Promise.resolve(Response.json({ revision: 2 }));
  };
  try {
    const key = { key: "s", ctrlKey: true, target: { tagName: "INPUT" }, preventDefault() {} };
    const field = await typing(() => one.site = site("typed"), () => one.key(key));
    equal([sent, field.focused], [[site("typed")], true]);
  } finally {
    globalThis.fetch = before;
  }
});

Deno.test("what is being typed is taken in before another part is chosen", async () => {
  const one = editor(site("mine", "other")), chosen = { kind: "zone", index: 0 };
  Object.assign(one, { chosen, layer: { querySelector: () => null } });
  const told = [];
  await typing(() => told.push(one.chosen), () => one.choose({ kind: "zone", index: 1 }));
  equal([told, one.chosen.index], [[chosen], 1]);
});

Deno.test("what is being typed when the page is hidden is taken in and kept at once", async () => {
  const one = editor(site()), stored = new Map();
  const before = Object.getOwnPropertyDescriptor(globalThis, "localStorage");
  const value = { setItem: (key, text) => stored.set(key, text), getItem: (key) => stored.get(key) ?? null };
  Object.defineProperty(globalThis, "localStorage", { value, configurable: true });
  one.kept = new Draft();
  try {
    await typing(() => {}, () => one.leave());
    equal(one.kept.found(one.file), null);
    await typing(() => one.site = site("typed"), () => one.leave());
    equal(one.kept.found(one.file)?.site, site("typed"));
  } finally {
    Object.defineProperty(globalThis, "localStorage", before);
  }
});

Deno.test("what others save does not take the field away in which is being typed", async () => {
  const one = Object.assign(editor(site()), { tool: "select", takeIn: () => one.log.push("taken in") });
  await typing(() => {}, () => one.told(2));
  equal([one.newer, one.log], [true, []]);
});

Deno.test("a drawing that is on offer is kept again when the new one is discarded", () => {
  const one = editor(site());
  one.left = { site: site("left") };
  one.cancel();
  equal(one.log, [one.left, "closed "]);
  const stored = new Map(), before = Object.getOwnPropertyDescriptor(globalThis, "localStorage");
  const value = { setItem: (key, text) => stored.set(key, text), getItem: (key) => stored.get(key) ?? null };
  Object.defineProperty(globalThis, "localStorage", { value, configurable: true });
  try {
    const draft = new Draft();
    draft.keep(one);
    draft.restore(one.file, one.left);
    equal(draft.found(one.file), one.left);
  } finally {
    Object.defineProperty(globalThis, "localStorage", before);
  }
});

Deno.test("where the browser keeps nothing, the editor closes all the same", () => {
  const before = Object.getOwnPropertyDescriptor(globalThis, "localStorage");
  const get = () => {
    throw new DOMException("site data is blocked", "SecurityError");
  };
  Object.defineProperty(globalThis, "localStorage", { get, configurable: true });
  try {
    const draft = new Draft();
    draft.forget("home.toml");
    equal(draft.found("home.toml"), null);
  } finally {
    Object.defineProperty(globalThis, "localStorage", before);
  }
});

Deno.test("Enter ends what is drawn, and on a button it presses that", () => {
  const one = editor(site());
  Object.assign(one, { draft: { points: [] }, finish: () => one.log.push("finished") });
  const press = (isButton) =>
    one.key({
      key: "Enter",
      target: { tagName: isButton ? "BUTTON" : "svg", closest: (of) => isButton && of.includes("button") },
      preventDefault: () => one.log.push("taken"),
    });
  press(true);
  equal(one.log, []);
  press(false);
  equal(one.log, ["finished", "taken"]);
});
