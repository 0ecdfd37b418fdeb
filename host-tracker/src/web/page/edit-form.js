// The editor's form in the panel: the fields of the chosen part, and Save and Discard.

import { BLOCKS, KIND } from "./names.js";
import { doorFields } from "./edit-door.js";
import { fieldsOf } from "./edit-fields.js";
import { sentence } from "./edit-merge.js";
import { isTyped } from "./edit-typing.js";
import { html } from "./shapes.js";
import { dateTime, list, say, tell, word } from "./words.js";

/** The fields of a part of a kind; `change(does)` is a listener that lets `does(input)` change the part. */
function fields(editor, kind, part, change) {
  const of = fieldsOf(editor, part, change), { name, number, optional, tick, flag } = of;
  switch (kind) {
    case KIND.ZONE:
      return [
        name(),
        flag(say("field.count"), "count"),
        flag(say("field.enclosed"), "enclosed"),
        flag(say("field.secure"), "secure"),
        optional(say("field.people_max"), "people_max", say("field.no-limit"), true),
        optional(say("field.hold_s"), "hold_s", say("field.no-hold"), false),
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
      return [name(), destination(editor.site, part, of)];
    case KIND.LINE: {
      const onclick = change(() => [part.from, part.to] = [part.to, part.from]);
      return [
        name(),
        html("button", { type: "button", className: "button", id: "turn-round", onclick }, say("field.swap")),
      ];
    }
    case KIND.DOOR:
      return doorFields(editor, part, change, of);
    case KIND.MODULE:
      return [
        name(),
        number(say("field.x"), "x", "m", "field.metres"),
        number(say("field.y"), "y", "m", "field.metres"),
        number(say("field.yaw_deg"), "yaw_deg", "°", "field.degrees"),
        number(say("field.height_m"), "height_m", "m", "field.metres"),
        flag(say("field.upside_down"), "upside_down"),
      ];
    default:
      return [name()];
  }
}

/** The zone that an entry leads to. */
function destination(site, entry, { choice }) {
  const zones = (site.zone ?? []).map(({ name }) => [name, name]);
  const all = [["", say("field.zone-any")], ...zones];
  return choice(say("field.zone"), "zone", all, (zone) => entry.zone = zone || null);
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
    if (isTyped(event.target)) editor.showField();
    else editor.show();
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
    {
      className: "detail form",
      id: "edit-form",
      // What is being typed is a change already, which a click on Save takes in.
      oninput: ({ currentTarget }) => currentTarget.querySelector("#save").disabled = editor.saving,
    },
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
