// What the pages say, in the visitor's language: sentences by key, numbers, times, and the words of the page's own HTML.
//
//   ?lang=de ▸ what the chooser kept ▸ navigator.languages ▸ English     one dictionary is loaded: words-de.js
//   say("walk.sees", { modules: "left" }) ─▶ "Gesehen von left."

const LOADS = {
  en: () => import("./words-en.js"),
  de: () => import("./words-de.js"),
  ja: () => import("./words-ja.js"),
};
/** The languages by the names that they have themselves. */
export const LANGUAGES = { en: "English", de: "Deutsch", ja: "日本語" };
const KEPT = "kehai-language";

/** What this browser keeps; without a place for it, nothing. */
function kept(value) {
  try {
    if (value) localStorage.setItem(KEPT, value);
    return localStorage.getItem(KEPT);
  } catch {
    return null;
  }
}

const base = (tag) => tag.toLowerCase().split("-")[0];

/** The locale of a page: by what its address says, what was chosen before, and what the browser wishes. */
export function localeOf(asked, chosen, wished) {
  const pinned = [asked, chosen].find((tag) => tag && base(tag) in LOADS);
  // Of a language that is pinned the browser may know the region.
  if (pinned) return wished.find((tag) => base(tag) === base(pinned)) ?? pinned;
  return wished.find((tag) => base(tag) in LOADS) ?? "en";
}

const asked = new URLSearchParams(globalThis.location?.search ?? "").get("lang");
// A link that says a language is a choice: the pages it leads to are in it, too.
if (asked && base(asked) in LOADS) kept(base(asked));
const locale = localeOf(asked, kept(), globalThis.navigator?.languages ?? []);
/** One of LANGUAGES. */
export const language = base(locale);
const { default: words } = await LOADS[language]();

// Plain English is of no country; that of the United States has its clock of 12 hours.
const region = locale === "en" ? "en-GB" : locale;
const plurals = new Intl.PluralRules(region);
const lists = new Intl.ListFormat(region, { type: "conjunction" });

/** A number with so many digits behind the point. */
export const number = (value, digits = 0) =>
  new Intl.NumberFormat(region, { minimumFractionDigits: digits, maximumFractionDigits: digits })
    .format(value);

/** A number with as many digits as it needs, two at most behind the point. */
const plain = new Intl.NumberFormat(region, { maximumFractionDigits: 2 });

export const percent = (share, digits = 0) =>
  new Intl.NumberFormat(region, {
    style: "percent",
    minimumFractionDigits: digits,
    maximumFractionDigits: digits,
  }).format(share);

/** A length, an area, an angle; the units are the same in all languages. */
export const metres = (m, digits = 2) => `${number(m, digits)} m`;
export const centimetres = (m) => `${number(m * 100)} cm`;
export const squareMetres = (m2, digits = 1) => `${number(m2, digits)} m²`;
export const degrees = (deg, digits = 0) => `${number(deg, digits)}°`;

/** A length with as many digits as it needs. */
export const exactly = (m) => `${plain.format(m)} m`;

/** Names in a row. */
export const list = (names) => lists.format(names);

/** A time of day or a date, by Intl's options. */
export const time = (ms, options) => new Intl.DateTimeFormat(region, options).format(ms);

/** Parts of a sentence, texts and what stands for its places. */
export function parts(key, values = {}) {
  const entry = words[key];
  if (entry === undefined) throw new Error(`there are no words for ${key}`);
  const text = typeof entry === "string" ? entry : entry[plurals.select(values.n)] ?? entry.other;
  return text.split(/\{(\w+)\}/).map((part, index) => {
    if (index % 2 === 0) return part;
    const value = values[part];
    return typeof value === "number" ? plain.format(value) : value;
  }).filter((part) => part !== "");
}

/** A sentence; a number `n` decides between one and many. */
export const say = (key, values) => parts(key, values).join("");

/** Whether there are words for a key. */
export const has = (key) => key in words;

/** The word for one of a closed set; a newer one that is not known here is shown by its name. */
export const word = (set, name) => has(`${set}.${name}`) ? say(`${set}.${name}`) : String(name);

const MINUTE_S = 60, HOUR_S = 3600, DAY_S = 86_400;

/** A time span in its largest unit of which there are at least one and a half. */
export function age(s) {
  if (s < 1.5 * MINUTE_S) return say("age.s", { n: Math.round(s) });
  if (s < 1.5 * HOUR_S) return say("age.min", { n: Math.round(s / MINUTE_S) });
  if (s < 2 * DAY_S) return say("age.h", { n: Math.round(s / HOUR_S) });
  return say("age.days", { n: Math.round(s / DAY_S) });
}

/** How long ago. */
export const ago = (s) => say("age.ago", { age: age(s) });

/** A time of day; of another day, with that. */
export function clockTime(ms) {
  const today = new Date(ms).toDateString() === new Date().toDateString();
  const clock = { hour: "2-digit", minute: "2-digit", second: "2-digit" };
  return time(ms, today ? clock : { ...clock, weekday: "short" });
}

/** Date and time. */
export const dateTime = (ms) => time(ms, { dateStyle: "short", timeStyle: "medium" });

/** Says in an element what went wrong, or nothing. What the tracker says it says in English. */
export function tell(element, error) {
  element.textContent = error?.message ?? "";
  element.hidden = !error;
  if (error?.isOfTracker) element.lang = "en";
  else element.removeAttribute("lang");
}

/** Writes the words of the page's own HTML: `data-say` its text, `data-say-title` an attribute. */
function fill() {
  document.documentElement.lang = language;
  for (const element of document.querySelectorAll("*")) {
    for (const [name, key] of Object.entries(element.dataset ?? {})) {
      if (name === "say") element.textContent = say(key);
      else if (name.startsWith("say")) {
        element.setAttribute(
          name.slice(3).replace(/[A-Z]/g, (big) => `-${big.toLowerCase()}`).slice(1),
          say(key),
        );
      }
    }
  }
  const chooser = document.getElementById("language");
  if (chooser) offer(chooser);
}

/** Offers the languages; the page begins anew in the one that is chosen. */
export function offer(chooser) {
  chooser.setAttribute("aria-label", say("bar.language"));
  chooser.replaceChildren(
    ...Object.entries(LANGUAGES).map(([tag, name]) => {
      const option = new Option(name, tag, tag === language, tag === language);
      option.lang = tag;
      return option;
    }),
  );
  chooser.onchange = () => {
    kept(chooser.value);
    const address = new URL(location);
    address.searchParams.delete("lang");
    history.replaceState(null, "", address);
    location.reload();
  };
}

if (globalThis.document) fill();
