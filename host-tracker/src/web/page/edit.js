// Drawing: zones, walls, entries, lines, movers, doors and module poses, with undo; saved to the site file, or not at all.

import { Check } from "./edit-check.js";
import { Draft } from "./edit-draft.js";
import { form, tellOthers } from "./edit-form.js";
import { drawKey, KEYS, showCursor } from "./edit-keys.js";
import { question, sentence } from "./edit-merge.js";
import { cancel, down, move, rectangle, up } from "./edit-pointer.js";
import { editable } from "./edit-shapes.js";
import { Together } from "./edit-together.js";
import { Later, takeTyped } from "./edit-typing.js";
import { KIND } from "./names.js";
import { corners, create, freeName, GRID_M, html, KINDS, SELECT, setCorners } from "./shapes.js";
import { saveSite } from "./site-file.js";
import { say, word } from "./words.js";

const UNDO_MOST = 100;
/** A copy lies so far beside what it was made of, in metres. */
const BESIDE_M = 0.5;

export class Editor extends Together {
  /** `on.close(said)` with what is to be said about it, if anything, `on.change(site)` after every change, `on.form(element)` for what is chosen, `on.present(open)` when it opens and closes. */
  constructor(layer, view, on) {
    super();
    Object.assign(this, { layer, view, on, open: false });
    this.tools = document.getElementById("tools");
    this.hint = document.getElementById("hint");
    this.check = new Check(this);
    this.kept = new Draft();
    this.later = new Later(() => this.open && this.show());
    this.spoken = html("div", { className: "for-screen-readers", id: "edit-spoken", role: "status" });
    this.hint.after(this.spoken);
    globalThis.addEventListener("keydown", (event) => this.open && this.key(event));
    // Before the map, which the same keys move.
    globalThis.addEventListener("keydown", (event) => {
      if (!this.open || !drawKey(this, event)) return;
      event.preventDefault();
      event.stopPropagation();
    }, true);
  }

  say(words) {
    this.spoken.textContent = words;
  }

  start({ site, revision, file }) {
    Object.assign(this, {
      site: structuredClone(site),
      base: structuredClone(site),
      revision,
      file,
      newer: false,
      taken: [],
      others: [],
      conflicts: null,
      cursor: null,
      left: this.kept.found(file),
      undone: [],
      done: [],
      chosen: null,
      draft: null,
      drag: null,
      error: null,
      open: true,
      saving: false,
    });
    this.saved = JSON.stringify(this.site);
    if (JSON.stringify(this.left?.site) === this.saved) this.left = null;
    this.check.clear();
    this.say("");
    this.hint.hidden = this.tools.hidden = false;
    this.on.present(true);
    this.use(SELECT);
  }

  stop(said) {
    this.open = false;
    this.on.present(false);
    this.hint.hidden = this.tools.hidden = true;
    this.layer.replaceChildren();
    this.view.svg.classList.remove("drawing");
    this.on.close(said);
  }

  /** The tracker says who else has the editor open. */
  among(others) {
    this.others = others;
    if (this.open) tellOthers(this);
  }

  changed() {
    return JSON.stringify(this.site) !== this.saved;
  }

  /** The page is being hidden or left, perhaps for good: what is being typed is taken in, and the drawing kept at once. */
  leave() {
    if (!this.open) return;
    takeTyped();
    if (!this.changed()) return;
    this.kept.keep(this);
    this.kept.now();
  }

  /** Keeps the site for undo; call it before a change. */
  note() {
    this.done.push(JSON.stringify(this.site));
    if (this.done.length > UNDO_MOST) this.done.shift();
    this.undone = [];
  }

  back(from, to) {
    if (!from.length) return;
    to.push(JSON.stringify(this.site));
    this.site = JSON.parse(from.pop());
    this.chosen = this.part(this.chosen) ? this.chosen : null;
    this.show();
  }

  part(chosen) {
    return chosen && this.site[chosen.kind]?.[chosen.index];
  }

  /** Takes a tool; `byKey`: it was chosen by the keyboard, which goes on to draw. */
  use(tool, byKey = false) {
    const left = this.tool;
    this.tool = tool;
    this.draft = null;
    this.cursor = null;
    if (tool !== SELECT) this.chosen = null;
    this.view.svg.classList.toggle("drawing", tool !== SELECT);
    this.show();
    if (tool === SELECT) {
      if (left !== SELECT && document.activeElement === this.view.svg) {
        document.getElementById(`tool-${left}`)?.focus();
      }
      return;
    }
    // Enter and arrow keys are for the map now.
    this.view.svg.focus({ preventScroll: true });
    if (byKey) showCursor(this);
  }

  show() {
    this.later.done();
    this.showTools();
    this.hint.textContent = say(this.cursor ? KEYS : `hint.${this.tool}`);
    this.on.change(this.site);
    this.showShapes();
    const shown = this.conflicts ? question(this, () => this.settled()) : form(this);
    this.check.tell(shown);
    this.on.form(shown);
    this.check.ask();
    if (this.changed()) this.kept.keep(this);
    else this.unkeep();
  }

  /** Shows what was typed in a field: on the map at once, in the form soon. */
  showField() {
    this.on.change(this.site);
    this.showShapes();
    this.later.soon();
  }

  /** Keeps this drawing no longer, but the one of an earlier page that is still on offer. */
  unkeep() {
    if (this.left) this.kept.restore(this.file, this.left);
    else this.kept.forget(this.file);
  }

  showTools() {
    const button = (label, does, more = {}) =>
      html("button", { type: "button", onclick: does, ...more }, label);
    const tool = (name, label) =>
      button(label, (event) => this.use(name, event.detail === 0), {
        disabled: Boolean(this.conflicts),
        id: `tool-${name}`,
        "aria-pressed": String(this.tool === name),
      });
    const focused = document.activeElement?.id;
    const parts = [
      tool(SELECT, say("edit.select")),
      ...Object.keys(KINDS).map((kind) => tool(kind, word("kind", kind))),
      html("hr"),
      button(say("edit.undo"), () => this.back(this.done, this.undone), {
        id: "undo",
        disabled: !this.done.length,
      }),
      button(say("edit.redo"), () => this.back(this.undone, this.done), {
        id: "redo",
        disabled: !this.undone.length,
      }),
    ];
    const box = rectangle(this);
    if (this.draft?.points.length >= KINDS[this.tool]?.least) {
      parts.push(button(say("edit.finish"), () => this.finish(), { id: "finish" }));
    } else if (box) {
      parts.push(button(say("edit.finish-rectangle"), () => this.finish(box), { id: "finish" }));
    }
    this.tools.replaceChildren(...parts);
    if (focused && this.tools.querySelector(`#${focused}`)) document.getElementById(focused).focus();
  }

  showShapes() {
    this.layer.replaceChildren(...editable(this));
  }

  down(place, event) {
    return this.open && !this.conflicts && down(this, place, event);
  }

  move(place, moved, event) {
    if (this.open && !this.conflicts) move(this, place, moved, event);
  }

  up(place, event) {
    if (this.open && !this.conflicts) up(this, place, event);
  }

  /** The pointer that was taken is another's now. */
  letGo() {
    if (this.open && !this.conflicts) cancel(this);
  }

  choose(chosen) {
    takeTyped();
    this.chosen = chosen;
    this.show();
    if (chosen) {
      this.layer.querySelector(`[data-kind=${chosen.kind}][data-index="${chosen.index}"]`)?.focus({
        preventScroll: true,
      });
    }
  }

  finish(points = this.draft?.points) {
    if (!points || points.length < KINDS[this.tool].least) return;
    this.note();
    const kind = this.tool;
    this.site[kind] = [...(this.site[kind] ?? []), create(kind, points, this.site)];
    this.draft = null;
    this.cursor = null;
    this.tool = SELECT;
    this.view.svg.classList.remove("drawing");
    const drawn = say("edit.part", { kind: word("kind", kind), name: this.site[kind].at(-1).name ?? "" })
      .trim();
    this.say(say("edit.drawn", { part: drawn, n: points.length }));
    this.choose({ kind, index: this.site[kind].length - 1 });
    const name = document.getElementById("part-name");
    if (name && matchMedia("(pointer: fine)").matches) {
      name.focus();
      name.select();
    }
  }

  remove() {
    const { kind, index } = this.chosen;
    this.note();
    this.site[kind].splice(index, 1);
    this.choose(null);
  }

  /** A copy of the chosen part beside it, under another name. */
  duplicate() {
    const { kind } = this.chosen, part = structuredClone(this.part(this.chosen));
    this.note();
    if (part.name !== undefined) {
      part.name = freeName(kind, part.name.replace(/ \d+$/, "") || kind, this.site);
    }
    setCorners(kind, part, corners(kind, part).map(([x, y]) => [x + BESIDE_M, y - BESIDE_M]));
    this.site[kind].push(part);
    this.choose({ kind, index: this.site[kind].length - 1 });
  }

  key(event) {
    if (this.conflicts) return;
    const typing = ["INPUT", "SELECT"].includes(event.target.tagName);
    const ctrl = event.ctrlKey || event.metaKey, key = event.key.toLowerCase();
    // Enter there presses the button.
    const onButton = event.target.closest?.("button, a, summary");
    const step = { arrowleft: [-1, 0], arrowright: [1, 0], arrowup: [0, 1], arrowdown: [0, -1] }[key];
    if (ctrl && key === "s") {
      takeTyped();
      this.save();
    } else if (typing) return;
    else if (ctrl && key === "z") {
      event.shiftKey ? this.back(this.undone, this.done) : this.back(this.done, this.undone);
    } else if (ctrl && key === "y") this.back(this.undone, this.done);
    else if (ctrl && key === "d" && this.part(this.chosen)) this.duplicate();
    else if (key === "escape") this.draft || this.tool !== SELECT ? this.use(SELECT) : this.choose(null);
    else if (key === "enter" && this.draft && !onButton) this.finish();
    else if (key === "enter" && event.target.closest?.(".shape.chosen")) {
      document.querySelector("#edit-form :is(input, select)")?.focus();
    } else if ((key === "delete" || key === "backspace") && this.part(this.chosen)) this.remove();
    else if (step && this.part(this.chosen) && event.target.closest?.(".shape")) {
      this.note();
      const { kind } = this.chosen, part = this.part(this.chosen);
      setCorners(
        kind,
        part,
        corners(kind, part).map(([x, y]) => [x + step[0] * GRID_M, y + step[1] * GRID_M]),
      );
      this.choose(this.chosen);
    } else return;
    event.preventDefault();
  }

  /** Entries and doors follow the name of their zone. */
  rename(part, name) {
    const { entry = [], door = [] } = this.chosen.kind === KIND.ZONE ? this.site : {};
    for (const one of [...entry, ...door]) if (one.zone === part.name) one.zone = name;
    part.name = name;
  }

  cancel() {
    if (this.saving || this.changed() && !confirm(say("edit.discard-ask"))) return;
    this.unkeep();
    this.stop("");
  }

  async save() {
    if (this.saving || !this.changed()) return;
    this.saving = true;
    const sent = JSON.stringify(this.site), isAsSent = () => JSON.stringify(this.site) === sent;
    try {
      const { revision, merged } = await saveSite(this);
      this.saving = false;
      if (!isAsSent()) return this.goOn(sent, revision, merged);
      this.kept.forget(this.file);
      this.stop(merged ? say("edit.saved", { kept: sentence(merged) }) : "");
    } catch (error) {
      this.saving = false;
      // Both are in the answer, but for what was drawn meanwhile.
      if (error.answer?.merged && isAsSent()) this.take(error.answer);
      else if (error.answer?.merged) await this.takeIn();
      this.fail(error);
    }
  }
}
