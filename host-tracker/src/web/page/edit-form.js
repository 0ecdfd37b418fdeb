// The editor's form in the panel: the fields of the chosen part, and Save and Discard.

import { BLOCKS, KIND } from "./names.js";
import { sentence } from "./edit-merge.js";
import { html } from "./shapes.js";
import { dateTime, list, say, tell, word } from "./words.js";

const NAME_CHARACTERS = 64;

/** A field of the form; what is wrong with `key` is said under it. */
function field(label, properties, key, tick = false) {
  const input = html("input", { "aria-describedby": `wrong-${key}`, ...properties });
  const named = tick ? html("label", { className: "tick" }, input, label) : html("label", {}, label, input);
  return html("div", { dataset: { key } }, named, wrong(key));
}

const wrong = (key) =>
  html("p", { className: "error wrong", id: `wrong-${key}`, role: "alert", hidden: true, lang: "en" });

/** The fields of a part of a kind; `change(does)` is a listener that lets `does(input)` change the part. */
function fields(editor, kind, part, change) {
  const text = (label, key) =>
    field(label, {
      value: part[key],
      id: `part-${key}`,
      maxLength: NAME_CHARACTERS,
      onchange: change((input) => editor.rename(part, key, input.value.trim())),
    }, key);
  const number = (label, key, sign, unit) =>
    field(say("field.with-unit", { field: label, unit: sign }), {
      type: "number",
      step: "any",
      value: part[key],
      id: `part-${key}`,
      ariaLabel: say(unit, { field: label }),
      onchange: change((input) => {
        if (Number.isFinite(input.valueAsNumber)) part[key] = input.valueAsNumber;
      }),
    }, key);
  const most = () =>
    field(say("field.people_max"), {
      type: "number",
      min: 0,
      step: 1,
      value: part.people_max ?? "",
      placeholder: say("field.no-limit"),
      id: "part-people_max",
      onchange: change((input) => {
        const count = input.valueAsNumber;
        if (Number.isInteger(count) && count >= 0) part.people_max = count;
        else delete part.people_max;
      }),
    }, "people_max");
  const hold = () =>
    field(say("field.hold_s"), {
      type: "number",
      min: 0,
      step: "any",
      value: part.hold_s ?? "",
      placeholder: say("field.no-hold"),
      id: "part-hold_s",
      onchange: change((input) => {
        if (Number.isFinite(input.valueAsNumber)) part.hold_s = input.valueAsNumber;
        else delete part.hold_s;
      }),
    }, "hold_s");
  const tick = (label, key, checked, set) =>
    field(label, { type: "checkbox", checked, onchange: change((input) => set(input.checked)) }, key, true);
  const flag = (label, key) => tick(label, key, part[key], (on) => part[key] = on);
  switch (kind) {
    case KIND.ZONE:
      return [
        text(say("field.name"), "name"),
        flag(say("field.count"), "count"),
        flag(say("field.enclosed"), "enclosed"),
        flag(say("field.secure"), "secure"),
        most(),
        hold(),
      ];
    case KIND.WALL:
      return [
        tick(
          say("field.blocks"),
          "blocks",
          !part.blocks.includes(BLOCKS.BEAMS),
          (on) => {
            part.blocks = on ? [BLOCKS.PEOPLE] : [BLOCKS.PEOPLE, BLOCKS.BEAMS];
          },
        ),
        flag(say("field.mirror"), "mirror"),
      ];
    case KIND.ENTRY:
      return [text(say("field.name"), "name"), destination(editor.site, part, change)];
    case KIND.LINE: {
      const onclick = change(() => [part.from, part.to] = [part.to, part.from]);
      return [
        text(say("field.name"), "name"),
        html("button", { type: "button", className: "button", id: "turn-round", onclick }, say("field.swap")),
      ];
    }
    case KIND.MODULE:
      return [
        text(say("field.name"), "name"),
        number(say("field.x"), "x", "m", "field.metres"),
        number(say("field.y"), "y", "m", "field.metres"),
        number(say("field.yaw_deg"), "yaw_deg", "°", "field.degrees"),
        number(say("field.height_m"), "height_m", "m", "field.metres"),
        flag(say("field.upside_down"), "upside_down"),
      ];
    default:
      return [text(say("field.name"), "name")];
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
    html("option", { value: "" }, say("field.zone-any")),
    ...zones,
  );
  choice.setAttribute("aria-describedby", "wrong-zone");
  return html(
    "div",
    { dataset: { key: "zone" } },
    html("label", {}, say("field.zone"), choice),
    wrong("zone"),
  );
}

const button = (id, look, label, onclick, disabled = false) =>
  html("button", { type: "button", className: `button ${look}`, id, onclick, disabled }, label);

/** Says in the form what others have done, without making it anew. */
export function tellNews(editor) {
  document.getElementById("edit-news")?.replaceChildren(...news(editor));
}

/** Says in the form who else has the editor open; nothing of nobody. */
export function tellOthers(editor) {
  const said = document.getElementById("edit-others");
  if (said) said.textContent = among(editor);
}

/** Who else has the editor open, in words: names, and windows of nobody known. */
function among({ others }) {
  const names = others.map(({ name }) => name).filter((name) => name !== null);
  const windows = others.length - names.length;
  const all = [...new Set(names), ...(windows ? [say("news.window", { n: windows })] : [])];
  return all.length ? say("news.others", { n: others.length, names: list(all) }) : "";
}

/** What others have done, and what an earlier page has left. */
function news(editor) {
  const row = (id, words, ...buttons) =>
    html(
      "div",
      { className: "news", id, role: "status" },
      html("p", {}, words),
      html("div", { className: "row" }, ...buttons),
    );
  const all = [];
  if (editor.left) {
    all.push(row(
      "edit-left",
      say("news.left", { time: dateTime(editor.left.at_ms) }),
      button("left-drop", "", say("news.left-drop"), () => editor.drop()),
      button("left-take", "main", say("news.left-take"), () => editor.takeUp()),
    ));
  }
  if (editor.newer) {
    const take = say("news.take-in");
    all.push(row("edit-newer", say("news.newer"), button("take-in", "main", take, () => editor.takeIn())));
  }
  if (editor.taken.length) {
    all.push(html("p", { className: "fine", id: "edit-taken", role: "status" }, sentence(editor.taken)));
  }
  return all;
}

/** What went wrong with saving, if anything. */
function failed(error) {
  const said = html("p", { className: "error", id: "edit-error", role: "alert" });
  tell(said, error);
  return said;
}

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
      button("duplicate", "", say("edit.copy", { part: word("part", kind) }), () => editor.duplicate()),
      button("remove", "danger", say("edit.remove", { part: word("part", kind) }), () => editor.remove()),
    ]
    : [html("p", { className: "fine" }, say("edit.choose"))];
  const changed = editor.changed();
  return html(
    "section",
    { className: "detail form", id: "edit-form" },
    html("header", {}, html("h2", {}, part ? word("kind", kind) : say("edit.title"))),
    html("p", { className: "others", id: "edit-others", role: "status" }, among(editor)),
    html("div", { id: "edit-news" }, ...news(editor)),
    ...about,
    html("ul", { className: "error", id: "edit-wrong", hidden: true, lang: "en" }),
    failed(editor.error),
    html(
      "div",
      { className: "row" },
      button("cancel", "", say(changed ? "edit.discard" : "edit.done"), () => editor.cancel()),
      button("save", "main", say("edit.save"), () => editor.save(), editor.saving || !changed),
    ),
    html(
      "p",
      { className: "fine" },
      say("edit.saves", { file: editor.file }),
    ),
  );
}
