// Drawing: zones, walls, entries, movers and module poses, with undo; saved to the site file, or not at all.

import { form } from "./edit-form.js";
import { down, move, up } from "./edit-pointer.js";
import { editable } from "./edit-shapes.js";
import { KIND } from "./names.js";
import { ask } from "./net.js";
import { corners, create, GRID_M, html, KINDS, SELECT, setCorners } from "./shapes.js";

const UNDO_MOST = 100;

const HINTS = {
  [SELECT]: "Drag shapes and their corners. Small corners between add new ones.",
  [KIND.ZONE]: "Drag a rectangle, or click corner after corner; Enter or the first corner closes it.",
  [KIND.MOVER]: "Where a door leaf or curtain moves: drag a rectangle, or click its corners.",
  [KIND.WALL]: "Click corner after corner; Enter or Finish ends the wall.",
  [KIND.ENTRY]: "Click both ends of the line that people cross to come and go.",
  [KIND.MODULE]: "Click where the module is, then turn it by its handle.",
};

export class Editor {
  /** `on.close(saved)`, `on.change(site)` after every change, `on.form(element)` for what is chosen. */
  constructor(layer, view, on) {
    Object.assign(this, { layer, view, on, open: false });
    this.tools = document.getElementById("tools");
    this.hint = document.getElementById("hint");
    globalThis.addEventListener("keydown", (event) => this.open && this.key(event));
  }

  start({ site, revision, file }) {
    Object.assign(this, {
      site: structuredClone(site),
      revision,
      file,
      undone: [],
      done: [],
      chosen: null,
      draft: null,
      drag: null,
      error: "",
      open: true,
      saving: false,
    });
    this.saved = JSON.stringify(this.site);
    this.hint.hidden = this.tools.hidden = false;
    this.use(SELECT);
  }

  stop(saved) {
    this.open = false;
    this.hint.hidden = this.tools.hidden = true;
    this.layer.replaceChildren();
    this.view.svg.classList.remove("drawing");
    this.on.close(saved);
  }

  changed() {
    return JSON.stringify(this.site) !== this.saved;
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

  use(tool) {
    this.tool = tool;
    this.draft = null;
    if (tool !== SELECT) this.chosen = null;
    this.view.svg.classList.toggle("drawing", tool !== SELECT);
    this.show();
  }

  show() {
    this.showTools();
    this.hint.textContent = HINTS[this.tool];
    this.on.change(this.site);
    this.showShapes();
    this.on.form(form(this));
  }

  showTools() {
    const button = (label, does, more = {}) =>
      html("button", { type: "button", onclick: does, ...more }, label);
    const tool = (name, label) =>
      button(label, () => this.use(name), { id: `tool-${name}`, "aria-pressed": String(this.tool === name) });
    const focused = document.activeElement?.id;
    const parts = [
      tool(SELECT, "Select"),
      ...Object.entries(KINDS).map(([kind, { word }]) => tool(kind, word)),
      html("hr"),
      button("Undo", () => this.back(this.done, this.undone), { id: "undo", disabled: !this.done.length }),
      button("Redo", () => this.back(this.undone, this.done), { id: "redo", disabled: !this.undone.length }),
    ];
    if (this.draft?.points.length >= KINDS[this.tool]?.least) {
      parts.push(button("Finish", () => this.finish(), { id: "finish" }));
    }
    this.tools.replaceChildren(...parts);
    if (focused && this.tools.querySelector(`#${focused}`)) document.getElementById(focused).focus();
  }

  showShapes() {
    this.layer.replaceChildren(...editable(this));
  }

  down(place, event) {
    return this.open && down(this, place, event);
  }

  move(place, moved) {
    if (this.open) move(this, place, moved);
  }

  up(place, event) {
    if (this.open) up(this, place, event);
  }

  choose(chosen) {
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
    this.tool = SELECT;
    this.view.svg.classList.remove("drawing");
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

  key(event) {
    const typing = ["INPUT", "SELECT"].includes(event.target.tagName);
    const ctrl = event.ctrlKey || event.metaKey, key = event.key.toLowerCase();
    const step = { arrowleft: [-1, 0], arrowright: [1, 0], arrowup: [0, 1], arrowdown: [0, -1] }[key];
    if (ctrl && key === "s") this.save();
    else if (typing) return;
    else if (ctrl && key === "z") {
      event.shiftKey ? this.back(this.undone, this.done) : this.back(this.done, this.undone);
    } else if (ctrl && key === "y") this.back(this.undone, this.done);
    else if (key === "escape") this.draft || this.tool !== SELECT ? this.use(SELECT) : this.choose(null);
    else if (key === "enter" && this.draft) this.finish();
    else if ((key === "delete" || key === "backspace") && this.part(this.chosen)) this.remove();
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

  /** Entries follow the name of their zone. */
  rename(part, key, name) {
    if (key === "name" && this.chosen.kind === "zone") {
      for (const entry of this.site.entry ?? []) if (entry.zone === part.name) entry.zone = name;
    }
    part[key] = name;
  }

  cancel() {
    if (this.changed() && !confirm("Discard what you have drawn?")) return;
    this.stop(false);
  }

  async save() {
    if (this.saving || !this.changed()) return;
    this.saving = true;
    try {
      const body = JSON.stringify({ revision: this.revision, site: this.site });
      await ask("/api/site", { method: "PUT", headers: { "Content-Type": "application/json" }, body });
      this.stop(true);
    } catch (error) {
      this.error = error.message;
      this.saving = false;
      this.show();
      this.error = "";
    }
  }
}
