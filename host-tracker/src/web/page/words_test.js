// The dictionaries: the same keys and places in each, every key used, no word of a page outside of them: `deno test --allow-read`.

import de from "./words-de.js";
import en from "./words-en.js";
import ja from "./words-ja.js";
import { localeOf, parts, say, word } from "./words.js";

const HERE = new URL(".", import.meta.url);
const SCHEMAS = new URL("../../../../docs/schemas/openapi.json", import.meta.url);
const LANGUAGES = { en, de, ja };
/** Sets whose words are asked for by the names that the tracker sends: the schema of each. */
const SETS = {
  alarm: ["AlarmKind", "DoorAlarm"],
  remedy: ["AlarmKind", "DoorAlarm"],
  severity: ["Severity"],
  module: ["DeviceState"],
  lock: ["Lock"],
  contact: ["Contact"],
  phase: ["Phase"],
  trouble: ["DoorTrouble"],
  prompt: ["DoorPrompt"],
  outcome: ["PassageOutcome"],
  zone: ["ZoneKnown"],
  fail: ["Fail"],
  verdict: ["Verdict"],
  life: ["Life"],
  hides: ["Why"],
  purpose: ["Purpose"],
  advice: ["CalibrationAdvice"],
  refused: ["CalibrationRefusal"],
  grade: ["CalibrationGrade"],
  figure: ["Unit"],
};
/** Texts of pages that are no words of a language: names, keys of the keyboard, methods and headers of requests. */
const NO_WORDS = new Set([
  "kehai",
  "Content-Type",
  "probe-rs download ${chip} --binary-format hex ${file(PURPOSE.DEBUGGER)}\\nprobe-rs reset ${chip}",
  "Bearer ${token}",
  "PUT",
  "POST",
  "DELETE",
  "English",
  "Deutsch",
  "INPUT",
  "SELECT",
  "Enter",
  "Escape",
  "Backspace",
  "Shift",
  // Names of classes that are chosen among.
  "fields chosen",
  "wall glass",
  "plan-wall glass",
  "words uncertain",
  "key hatched",
  // For programmers.
  "there are no words for ${key}",
]);

function equal(found, expected) {
  const [one, other] = [found, expected].map((value) => JSON.stringify(value));
  if (one !== other) throw new Error(`${one} is not ${other}`);
}

/** Files of the page by an ending, without dictionaries and tests. */
function sources(ending) {
  const names = [...Deno.readDirSync(HERE)].map(({ name }) => name);
  return names.filter((name) => name.endsWith(ending) && !/^words-\w\w\.js$|_test\.js$/.test(name)).sort()
    .map((name) => [name, Deno.readTextFileSync(new URL(name, HERE))]);
}

const texts = (entry) => typeof entry === "string" ? [entry] : Object.values(entry);
const places = (entry) =>
  [...new Set(texts(entry).flatMap((text) => [...text.matchAll(/\{(\w+)\}/g)].map(([, name]) => name)))]
    .sort();

/** The string literals of a script, without comments: [text, what stands before it]. Templates keep their `${…}`. */
function literals(script) {
  const token =
    /\/\/[^\n]*|\/\*[\s\S]*?\*\/|\/(?![/*\s])(?:\\.|\[[^\]]*\]|[^/\\\n[])+\/[gimsu]*(?=[.,;)])|"(?:\\.|[^"\\\n])*"|`(?:\\.|[^`\\])*`/g;
  return [...script.matchAll(token)].filter(([text]) => /^["`]/.test(text))
    .map(({ 0: text, index }) => [text.slice(1, -1), script.slice(Math.max(0, index - 60), index)]);
}

Deno.test("all dictionaries have the same keys and the same places", () => {
  for (const [name, words] of Object.entries(LANGUAGES)) {
    equal([name, ...Object.keys(words)], [name, ...Object.keys(en)]);
    for (const [key, entry] of Object.entries(words)) {
      equal([name, key, ...places(entry)], [name, key, ...places(en[key])]);
      equal([name, key, texts(entry).every((text) => text.length > 0)], [name, key, true]);
    }
  }
});

Deno.test("every plural has the forms of its language", () => {
  for (const [name, words] of Object.entries(LANGUAGES)) {
    const forms = new Intl.PluralRules(name).resolvedOptions().pluralCategories.toSorted();
    for (const [key, entry] of Object.entries(words)) {
      if (typeof entry !== "string") equal([name, key, ...Object.keys(entry).sort()], [name, key, ...forms]);
    }
  }
});

Deno.test("every key is used, and every key that is used is there", () => {
  const used = new Set(), prefixes = [];
  for (const [name, script] of sources(".js")) {
    for (const [text, before] of literals(script)) {
      used.add(text);
      const open = /^([a-z]+\.[a-z-]*)\$\{/.exec(text);
      if (open) prefixes.push(open[1]);
      if (/(?<![.\w])(say|parts)\($/.test(before) && !text.includes("${")) {
        equal([name, text, text in en], [name, text, true]);
      }
    }
    for (const [, set] of script.matchAll(/\bword\(\s*"([a-z]+)"/g)) prefixes.push(`${set}.`);
  }
  for (const [name, page] of sources(".html")) {
    for (const [, key] of page.matchAll(/ data-say[a-z-]*="([^"]*)"/g)) {
      equal([name, key, key in en], [name, key, true]);
      used.add(key);
    }
  }
  equal(
    Object.keys(en).filter((key) => !used.has(key) && !prefixes.some((open) => key.startsWith(open))),
    [],
  );
});

Deno.test("every name of a closed set has words", () => {
  const { components: { schemas } } = JSON.parse(Deno.readTextFileSync(SCHEMAS));
  const names = ({ enum: all, const: one, oneOf, anyOf, properties }) =>
    one !== undefined
      ? [one]
      : all ?? (oneOf ?? anyOf)?.flatMap(names) ?? (properties?.is ? names(properties.is) : []);
  for (const [set, kinds] of Object.entries(SETS)) {
    for (const kind of kinds) {
      const all = names(schemas[kind] ?? {});
      equal([kind, all.length > 0], [kind, true]);
      equal([kind, ...all.filter((name) => !(`${set}.${name}` in en))], [kind]);
    }
  }
});

Deno.test("no page has a word of its own", () => {
  const found = [];
  const isText = (text) => !NO_WORDS.has(text) && /\p{L}{2}/u.test(text);
  for (const [name, page] of sources(".html")) {
    const own = page.replace(/<noscript\s+lang="en"\s*>.*?<\/noscript>|<!doctype html>|<title /gs, "");
    for (const [, text] of own.matchAll(/>([^<>]+)</g)) {
      if (isText(text.trim())) found.push([name, text.trim()]);
    }
    for (const [, , text] of own.matchAll(/ (title|aria-label|placeholder|alt)="([^"]*)"/g)) {
      if (isText(text)) found.push([name, text]);
    }
  }
  for (const [name, script] of sources(".js")) {
    for (const [text, before] of literals(script)) {
      // Names of classes, selectors, paths and styles are for browsers.
      if (
        /(class\w*|style|[Ff]or|part|type|id|autocomplete|import.*|from|query\w*\(|closest\(|d|transform|accept|viewBox|rel)["]?[:(= ]*\s*$/
          .test(before)
      ) continue;
      const plain = text.replace(/\$\{[^}]*\}/g, "").trim();
      if (!isText(text) || !isText(plain) || /^(<|kehai-sim )/.test(plain)) continue;
      if (/^[A-Z][a-z]+$/.test(plain) || /\p{L}{2,},? \p{L}{2,}/u.test(plain)) found.push([name, text]);
    }
  }
  for (const [name, sheet] of sources(".css")) {
    for (const [, text] of sheet.matchAll(/content: "([^"]*)"/g)) if (isText(text)) found.push([name, text]);
  }
  equal(found, []);
});

Deno.test("the language is what a link says, what was chosen, what the browser wishes, or English", () => {
  equal(localeOf("ja", "de", ["en-US"]), "ja");
  equal(localeOf(null, "de", ["en-US", "de-AT"]), "de-AT");
  equal(localeOf("xx", null, ["fr-FR", "ja-JP", "en"]), "ja-JP");
  equal(localeOf(null, null, ["fr-FR"]), "en");
});

Deno.test("numbers decide between one and many, and elements stand in their places", () => {
  equal([1, 2].map((n) => say("spoken.people", { n })), ["1 person", "2 people"]);
  const mark = { is: "an element" };
  equal(parts("alarms.since", { time: mark }), ["since ", mark]);
  equal(word("module", "a-newer-one"), "a-newer-one");
});
