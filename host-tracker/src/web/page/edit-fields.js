// Fields of a part in the editor's form: each changes the part, and what is wrong with its key is said under it.
//
//   ╭ data-key ───────────────────────╮
//   │ label  [ input or select      ] │
//   │ what the tracker would refuse   │  filled in by edit-check.js
//   ╰─────────────────────────────────╯

import { html } from "./shapes.js";
import { say } from "./words.js";

const NAME_CHARACTERS = 64;
/** Largest whole number of a site file: it has 32 bits. */
const WHOLE_MOST = 2 ** 32 - 1;
const whole = (value) => Math.min(Math.max(Math.round(value), 0), WHOLE_MOST);

/** A field around its input; what is wrong with `key` is said under it. */
function field(label, input, key, tick = false) {
  input.setAttribute("aria-describedby", wrongOf(key));
  const named = tick ? html("label", { className: "tick" }, input, label) : html("label", {}, label, input);
  return html("div", { dataset: { key } }, named, wrong(key));
}

const wrongOf = (key) => `wrong-${key}`;

const wrong = (key) =>
  html("p", { className: "error wrong", id: wrongOf(key), role: "alert", hidden: true, lang: "en" });

const withUnit = (label, unit) => say("field.with-unit", { field: label, unit });

/** Makes fields of a part; `change(does)` is a listener that lets `does(input)` change the part. */
export function fieldsOf(editor, part, change) {
  const numeric = (label, value, spoken, set, more = {}) =>
    html("input", {
      type: "number",
      step: "any",
      value,
      ariaLabel: spoken ?? label,
      onchange: change((input) => {
        // One that is emptied keeps its value.
        if (Number.isFinite(input.valueAsNumber)) set(input.valueAsNumber);
      }),
      ...more,
    });
  const tick = (label, key, checked, set) => {
    const onchange = change((input) => set(input.checked));
    return field(label, html("input", { type: "checkbox", checked, onchange, id: `part-${key}` }), key, true);
  };
  return {
    name: () =>
      field(
        say("field.name"),
        html("input", {
          value: part.name,
          id: "part-name",
          maxLength: NAME_CHARACTERS,
          onchange: change((input) => editor.rename(part, input.value.trim())),
        }),
        "name",
      ),
    number: (label, key, unit, spoken) => {
      const set = (value) => part[key] = value;
      const aloud = say(spoken, { field: label });
      return field(
        withUnit(label, unit),
        numeric(label, part[key], aloud, set, { id: `part-${key}` }),
        key,
      );
    },
    /** A number of things, which the tracker reads as a whole one. */
    whole: (label, key) => {
      const set = (value) => part[key] = whole(value);
      return field(
        label,
        numeric(label, part[key], null, set, { id: `part-${key}`, min: 0, step: 1 }),
        key,
      );
    },
    /** A place: x and y, in metres. */
    place: (key) => {
      const axes = [say("field.x"), say("field.y")].map((label, axis) => {
        const set = (value) => part[key][axis] = value;
        const aloud = say("field.metres", { field: label }), id = `part-${key}-${axis ? "y" : "x"}`;
        const input = numeric(label, part[key][axis], aloud, set, { id });
        input.setAttribute("aria-describedby", wrongOf(key));
        return html("label", {}, withUnit(label, "m"), input);
      });
      return html("div", { className: "fields", dataset: { key } }, ...axes, wrong(key));
    },
    tick,
    flag: (label, key) => tick(label, key, Boolean(part[key]), (on) => part[key] = on),
    /** One of `options`, [value, words]. */
    choice: (label, key, options, set) => {
      const all = options.map(([value, words]) =>
        html("option", { value, selected: value === (part[key] ?? "") }, words)
      );
      const onchange = change((input) => set(input.value));
      return field(label, html("select", { id: `part-${key}`, onchange }, ...all), key);
    },
    /** A number that may be left out, for which `none` stands then; a number of things is taken as a whole one. */
    optional: (label, key, none, ofThings) =>
      field(
        label,
        html("input", {
          type: "number",
          min: 0,
          step: ofThings ? 1 : "any",
          value: part[key] ?? "",
          placeholder: none,
          id: `part-${key}`,
          onchange: change((input) => {
            if (Number.isFinite(input.valueAsNumber)) {
              part[key] = ofThings ? whole(input.valueAsNumber) : input.valueAsNumber;
            } else delete part[key];
          }),
        }),
        key,
      ),
  };
}
