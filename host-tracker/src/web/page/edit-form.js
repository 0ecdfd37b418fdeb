// The editor's form in the panel: the fields of the chosen part, and Save and Discard.

import { BLOCKS, KIND } from "./names.js";
import { html, KINDS } from "./shapes.js";

const NAME_CHARACTERS = 64;

/** A field of the form: its element, changing `part` through `change`. */
function field(label, properties, tick = false) {
  const input = html("input", properties);
  return tick ? html("label", { className: "tick" }, input, label) : html("label", {}, label, input);
}

/** The fields of a part of a kind; `change(does)` is a listener that lets `does(input)` change the part. */
function fields(editor, kind, part, change) {
  const text = (label, key) =>
    field(label, {
      value: part[key],
      id: `part-${key}`,
      maxLength: NAME_CHARACTERS,
      onchange: change((input) => editor.rename(part, key, input.value.trim())),
    });
  const number = (label, key, sign, unit) =>
    field(`${label} (${sign})`, {
      type: "number",
      step: "any",
      value: part[key],
      id: `part-${key}`,
      ariaLabel: `${label}, ${unit}`,
      onchange: change((input) => {
        if (Number.isFinite(input.valueAsNumber)) part[key] = input.valueAsNumber;
      }),
    });
  const tick = (label, checked, set) =>
    field(label, { type: "checkbox", checked, onchange: change((input) => set(input.checked)) }, true);
  const flag = (label, key) => tick(label, part[key], (on) => part[key] = on);
  switch (kind) {
    case KIND.ZONE:
      return [
        text("Name", "name"),
        flag("Count people in it", "count"),
        flag("Enclosed by walls and entries", "enclosed"),
        flag("Secure: unexplained tracks count too", "secure"),
      ];
    case KIND.WALL:
      return [
        tick("Glass: stops people, lets beams through", !part.blocks.includes(BLOCKS.BEAMS), (on) => {
          part.blocks = on ? [BLOCKS.PEOPLE] : [BLOCKS.PEOPLE, BLOCKS.BEAMS];
        }),
        flag("Mirror", "mirror"),
      ];
    case KIND.ENTRY:
      return [text("Name", "name"), destination(editor.site, part, change)];
    case KIND.MODULE:
      return [
        text("Name", "name"),
        number("x", "x", "m", "m"),
        number("y", "y", "m", "m"),
        number("Turned", "yaw_deg", "°", "degrees"),
        number("Height", "height_m", "m", "m"),
      ];
    default:
      return [text("Name", "name")];
  }
}

/** The zone that an entry leads to. */
function destination(site, entry, change) {
  const zones = (site.zone ?? []).map(({ name }) =>
    html("option", { value: name, selected: entry.zone === name }, name)
  );
  const choice = html(
    "select",
    { onchange: change((input) => entry.zone = input.value || null) },
    html("option", { value: "" }, "the one that counts"),
    ...zones,
  );
  return html("label", {}, "Leads to", choice);
}

const button = (id, look, label, onclick, disabled = false) =>
  html("button", { type: "button", className: `button ${look}`, id, onclick, disabled }, label);

/** The whole form, for the chosen part or none. */
export function form(editor) {
  const part = editor.part(editor.chosen), kind = editor.chosen?.kind;
  const change = (does) => (event) => {
    editor.note();
    does(event.target);
    editor.show();
  };
  const about = part
    ? [
      ...fields(editor, kind, part, change),
      button("remove", "danger", `Remove this ${KINDS[kind].word.toLowerCase()}`, () => editor.remove()),
    ]
    : [html("p", { className: "fine" }, "Choose a shape on the map, or draw a new one.")];
  const changed = editor.changed();
  return html(
    "section",
    { className: "detail form" },
    html("header", {}, html("h2", {}, part ? KINDS[kind].word : "Edit the site")),
    ...about,
    html("p", { className: "error", id: "edit-error", role: "alert", hidden: !editor.error }, editor.error),
    html(
      "div",
      { className: "row" },
      button("cancel", "", changed ? "Discard" : "Done", () => editor.cancel()),
      button("save", "main", "Save", () => editor.save(), editor.saving || !changed),
    ),
    html(
      "p",
      { className: "fine" },
      `Saves to ${editor.file}. Comments in that file are not kept. Tracking starts anew when the site changes.`,
    ),
  );
}
