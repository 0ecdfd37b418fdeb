// What is asked of the tray while it does something else: `deno test`.

// Before there is a document, which would be filled with words.
import "./words.js";

// What asks who has logged in takes hold of a button at once.
globalThis.document = { getElementById: () => ({}) };
const { Tray } = await import("./tray.js");
delete globalThis.document;

function equal(found, expected) {
  const [one, other] = [found, expected].map((value) => JSON.stringify(value));
  if (one !== other) throw new Error(`${one} is not ${other}`);
}

Deno.test("what is asked while the tray does something is done after it, also after it failed", async () => {
  const did = [];
  const tray = Object.assign(Object.create(Tray.prototype), {
    busy: Promise.resolve(),
    button: {},
    error: { removeAttribute() {} },
    on: { site: (revision) => did.push(revision) },
  });
  let refuse = null;
  const first = tray.does(() => new Promise((_, no) => refuse = () => no(new Error("does not answer"))));
  const second = tray.does(() => {
    did.push(tray.error.textContent);
    return Promise.resolve({ revision: 2 });
  });
  await Promise.resolve();
  equal([did, tray.button.disabled], [[], true]);
  refuse();
  await Promise.all([first, second]);
  equal([did, tray.button.disabled], [["does not answer", 2], false]);
});
