// Two who edit at once: what others have saved is taken into the drawing, and where both have changed the same part, this page asks.

import { BLOCKS, KIND } from "./names.js";
import { corners, html, KINDS, path, svg } from "./shapes.js";
import { list, say, word } from "./words.js";

const MINE = "mine", THEIRS = "theirs";

const CHANGES_MOST = 5;

/** Fields of a door that have words of their own. */
const OF_DOORS = { zone: "guards", people_max: "group" };

/** A sentence of changes, as the tracker lists them, in English. */
export const sentence = (changes) => {
  const rest = changes.length - CHANGES_MOST;
  const more = rest > 0 ? say("news.more", { n: rest }) : "";
  return say("news.kept", { changes: changes.slice(0, CHANGES_MOST).join(", ") + more });
};

/** Puts what was chosen of each conflict into the site. */
export function settle(site, conflicts) {
  const taken = [];
  for (const { kind, index, choice, mine, theirs } of conflicts) {
    const part = choice === MINE ? mine : theirs;
    if (part) site[kind][index] = part;
    else taken.push([kind, index]);
  }
  // From the last, so that those before keep their places.
  for (const [kind, index] of taken.sort(([, a], [, b]) => b - a)) site[kind].splice(index, 1);
}

/** A value of a field, in words. */
function valued(value) {
  if (value === undefined || value === null) return say("merge.none");
  if (typeof value === "boolean") return say(value ? "merge.yes" : "merge.no");
  return typeof value === "string" ? say("merge.quoted", { text: value }) : String(value);
}

/** What differs between two versions of a part, in words. */
function differs(kind, mine, theirs) {
  const keys = [...new Set([...Object.keys(mine), ...Object.keys(theirs)])];
  const different = keys.filter((key) => JSON.stringify(mine[key]) !== JSON.stringify(theirs[key]));
  const said = different.map((key) =>
    Array.isArray(mine[key] ?? theirs[key]) ? say("merge.shape") : say("merge.either", {
      field: word("field", kind === KIND.DOOR ? OF_DOORS[key] ?? key : key),
      mine: valued(mine[key]),
      theirs: valued(theirs[key]),
    })
  );
  return list([...new Set(said)]);
}

/** What a conflict is about. */
const labelOf = ({ kind, index, mine, theirs }) => {
  const { name } = mine ?? theirs;
  return say("edit.part", { kind: word("kind", kind), name: name || index + 1 });
};

/** Asks which to keep of each; `done` once all are decided. */
export function question(editor, done) {
  const { conflicts } = editor;
  const ready = html("button", {
    type: "button",
    className: "button main",
    id: "settle",
    disabled: true,
    onclick: done,
  }, say("merge.keep"));
  const decide = (conflict, choice) => {
    conflict.choice = choice;
    ready.disabled = conflicts.some((one) => !one.choice);
    editor.showShapes();
  };
  const radio = (conflict, number, choice, words) =>
    html(
      "label",
      { className: "tick" },
      html("input", {
        type: "radio",
        name: `conflict-${number}`,
        value: choice,
        checked: conflict.choice === choice,
        onchange: () => decide(conflict, choice),
      }),
      words,
    );
  const asked = conflicts.map((conflict, number) => {
    const { kind, mine, theirs } = conflict;
    const did = mine && theirs ? "merge.both-changed" : mine ? "merge.they-removed" : "merge.i-removed";
    const both = mine && theirs ? say("merge.different", { what: differs(kind, mine, theirs) }) : "";
    return html(
      "fieldset",
      { className: "conflict" },
      html("legend", {}, labelOf(conflict)),
      html("p", { className: "fine" }, [say(did), both].join(" ")),
      radio(conflict, number, MINE, say(mine ? "merge.mine" : "merge.mine-removed")),
      radio(
        conflict,
        number,
        THEIRS,
        say(theirs ? "merge.theirs" : "merge.theirs-removed"),
      ),
    );
  });
  return html(
    "section",
    { className: "detail form", id: "conflicts" },
    html("header", {}, html("h2", {}, say("merge.title"))),
    html("p", { role: "alert" }, say("merge.help")),
    ...asked,
    html("div", { className: "row" }, ready),
  );
}

/** Their versions on the map, until it is decided. */
export function theirShapes(editor, px) {
  return (editor.conflicts ?? []).filter(({ theirs, choice }) => theirs && choice !== MINE).flatMap(
    (conflict) => {
      const { kind, theirs } = conflict;
      if (!KINDS[kind]) return [];
      const points = corners(kind, { blocks: [BLOCKS.PEOPLE], ...theirs });
      const shape = kind === KIND.MODULE
        ? svg("circle", { class: "theirs", cx: points[0][0], cy: -points[0][1], r: 14 * px })
        : svg("path", { class: "theirs", d: path(points, KINDS[kind].closed) });
      const [x, y] = points[0];
      return [
        shape,
        svg(
          "text",
          { class: "length", x, y: -y, dy: "-.6em" },
          say("merge.theirs-label", { part: labelOf(conflict) }),
        ),
      ];
    },
  );
}
