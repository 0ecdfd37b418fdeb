// Drawing: zones, walls, entries, movers and module poses, with undo; saved to the site file, or not at all.

import { ask } from "./net.js";
import { KINDS, corners, create, html, path, setCorners, svg } from "./shapes.js";

const GRID_M = 0.05;
const SNAP_PX = 10, CLOSE_PX = 16;
const TURN_PX = 44;
const UNDO_MOST = 100;

const HINTS = {
  select: "Drag shapes and their corners. Small corners between add new ones.",
  zone: "Drag a rectangle, or click corner after corner; Enter or the first corner closes it.",
  mover: "Where a door leaf or curtain moves: drag a rectangle, or click its corners.",
  wall: "Click corner after corner; Enter or Finish ends the wall.",
  entry: "Click both ends of the line people come and go across.",
  module: "Click where the module is, then turn it by its handle.",
};

export class Editor {
  /** `on.close(saved)`, `on.change(site)` after every change, `on.form(element)` for what is chosen. */
  constructor(layer, view, on) {
    Object.assign(this, { layer, view, on, open: false });
    this.tools = document.getElementById("tools");
    this.hint = document.getElementById("hint");
    window.addEventListener("keydown", (event) => this.open && this.key(event));
  }

  start({ site, revision, file }) {
    Object.assign(this, { site: structuredClone(site), revision, file, undone: [], done: [], chosen: null, draft: null, drag: null, error: "", open: true, saving: false });
    this.saved = JSON.stringify(this.site);
    this.hint.hidden = this.tools.hidden = false;
    this.use("select");
  }

  stop(saved) {
    this.open = false;
    this.hint.hidden = this.tools.hidden = true;
    this.layer.replaceChildren();
    this.view.svg.classList.remove("drawing");
    this.on.close(saved);
  }

  changed() { return JSON.stringify(this.site) !== this.saved; }

  /** Notes how it was, before something changes. */
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

  part(chosen) { return chosen && this.site[chosen.kind]?.[chosen.index]; }

  use(tool) {
    this.tool = tool;
    this.draft = null;
    if (tool !== "select") this.chosen = null;
    this.view.svg.classList.toggle("drawing", tool !== "select");
    this.show();
  }

  show() {
    this.showTools();
    this.hint.textContent = HINTS[this.tool];
    this.on.change(this.site);
    this.showShapes();
    this.on.form(this.form());
  }

  showTools() {
    const button = (label, does, more = {}) => html("button", { type: "button", onclick: does, ...more }, label);
    const tool = (name, label) => button(label, () => this.use(name), { id: `tool-${name}`, "aria-pressed": String(this.tool === name) });
    const focused = document.activeElement?.id;
    const parts = [tool("select", "Select"), ...Object.entries(KINDS).map(([kind, { word }]) => tool(kind, word)), html("hr"),
      button("Undo", () => this.back(this.done, this.undone), { id: "undo", disabled: !this.done.length }),
      button("Redo", () => this.back(this.undone, this.done), { id: "redo", disabled: !this.undone.length })];
    if (this.draft?.points.length >= KINDS[this.tool]?.least) parts.push(button("Finish", () => this.finish(), { id: "finish" }));
    this.tools.replaceChildren(...parts);
    if (focused && this.tools.querySelector(`#${focused}`)) document.getElementById(focused).focus();
  }

  showShapes() {
    const px = this.view.px, groups = [];
    for (const kind of ["zone", "mover", "wall", "entry", "module"]) {
      (this.site[kind] ?? []).forEach((part, index) => {
        const chosen = this.chosen?.kind === kind && this.chosen.index === index;
        const closed = KINDS[kind].closed, d = path(corners(kind, part), closed);
        const shape = kind === "module" ? svg("circle", { cx: part.x, cy: -part.y, r: 16 * px, fill: "transparent" })
          : svg("path", { d, class: kind === "wall" && !part.blocks.includes("beams") ? "wall glass" : kind });
        const group = svg("g", { class: `shape${chosen ? " chosen" : ""}`, "data-kind": kind, "data-index": index, tabindex: 0, role: "button",
          "aria-label": `${KINDS[kind].word} ${part.name ?? index + 1}` }, shape);
        if (kind !== "module") group.append(svg("path", { class: "grab", d }));
        group.addEventListener("focus", () => { if (!chosen && this.tool === "select" && !this.drag) this.choose({ kind, index }); });
        groups.push(group);
      });
    }
    this.layer.replaceChildren(...groups, ...this.handles(px), ...this.drafted(px));
  }

  handles(px) {
    const part = this.part(this.chosen);
    if (!part || this.tool !== "select") return [];
    const { kind } = this.chosen, points = corners(kind, part), { closed, most } = KINDS[kind];
    const handle = (extra, [x, y], r, data) => svg("circle", { class: `handle ${extra}`, cx: x, cy: -y, r: r * px, ...data });
    const handles = [];
    if (kind === "module") {
      const rad = (part.yaw_deg * Math.PI) / 180;
      handles.push(handle("turn", [part.x + Math.cos(rad) * TURN_PX * px, part.y + Math.sin(rad) * TURN_PX * px], 8, { "data-turn": 1 }));
    } else if (!most) {
      points.forEach((point, index) => {
        const next = points[index + 1] ?? (closed ? points[0] : null);
        if (next) handles.push(handle("mid", [(point[0] + next[0]) / 2, (point[1] + next[1]) / 2], 5.5, { "data-mid": index }));
      });
    }
    if (kind !== "module") points.forEach((point, index) => handles.push(handle("", point, 7.5, { "data-corner": index })));
    return handles;
  }

  drafted(px) {
    if (!this.draft) return [];
    const points = [...this.draft.points, ...(this.draft.next ? [this.draft.next] : [])];
    return [svg("path", { class: "draft", d: path(points, KINDS[this.tool].closed), style: KINDS[this.tool].closed ? "" : "fill:none" }),
      ...this.draft.points.map(([x, y]) => svg("circle", { class: "handle", cx: x, cy: -y, r: 6 * px }))];
  }

  choose(chosen) {
    this.chosen = chosen;
    this.show();
    if (chosen) this.layer.querySelector(`[data-kind=${chosen.kind}][data-index="${chosen.index}"]`)?.focus({ preventScroll: true });
  }

  /** Onto a corner nearby, in line with the corner before, or onto the grid. */
  snap([x, y], except = null) {
    const near = SNAP_PX * this.view.px;
    for (const kind of Object.keys(KINDS)) for (const part of this.site[kind] ?? []) {
      if (part === except || kind === "module") continue;
      const corner = corners(kind, part).find(([cx, cy]) => Math.hypot(cx - x, cy - y) < near);
      if (corner) return [...corner];
    }
    const last = this.draft?.points.at(-1);
    const grid = (metres) => Math.round(metres / GRID_M) * GRID_M;
    return [last && Math.abs(last[0] - x) < near ? last[0] : grid(x), last && Math.abs(last[1] - y) < near ? last[1] : grid(y)];
  }

  // Pointer: true takes it, so that the map stays where it is.
  down(place, event) {
    if (!this.open) return false;
    if (this.tool !== "select") { this.drag = { from: this.snap(place) }; return true; }
    const target = event.target.closest("[data-corner],[data-mid],[data-turn],[data-kind]");
    if (!target) { if (this.chosen) this.choose(null); return false; }
    const before = JSON.stringify(this.site);
    if (target.dataset.kind) {
      this.drag = { body: true };
      const chosen = { kind: target.dataset.kind, index: Number(target.dataset.index) };
      if (this.chosen?.kind !== chosen.kind || this.chosen.index !== chosen.index) this.choose(chosen);
    }
    const part = this.part(this.chosen);
    const points = corners(this.chosen.kind, part).map((point) => [...point]);
    this.drag = { before, part, points, from: place, turn: target.dataset.turn, body: Boolean(target.dataset.kind),
      corner: target.dataset.corner && Number(target.dataset.corner) };
    if (target.dataset.mid) {
      this.drag.corner = Number(target.dataset.mid) + 1;
      points.splice(this.drag.corner, 0, place);
    }
    return true;
  }

  move(place, event, moved) {
    if (!this.open) return;
    if (this.tool !== "select") {
      if (this.drag && moved && KINDS[this.tool].closed && !this.draft?.points.length) this.drag.to = this.snap(place);
      const { from, to } = this.drag ?? {};
      if (to) this.draft = { points: [], rectangle: [from, [to[0], from[1]], to, [from[0], to[1]]] };
      else if (this.draft) this.draft.next = this.snap(place);
      if (!this.draft) return;
      const shown = this.draft.rectangle ? { points: this.draft.rectangle } : this.draft;
      const draft = this.draft; this.draft = shown; this.showShapes(); this.draft = draft;
      return;
    }
    if (!this.drag || !moved) return;
    const { part, points, from, corner, turn } = this.drag, { kind } = this.chosen;
    if (turn) part.yaw_deg = Math.round((Math.atan2(place[1] - part.y, place[0] - part.x) * 180) / Math.PI);
    else if (corner !== undefined) setCorners(kind, part, points.map((point, index) => (index === corner ? this.snap(place, part) : point)));
    else {
      const by = [0, 1].map((axis) => Math.round((place[axis] - from[axis]) / GRID_M) * GRID_M);
      setCorners(kind, part, points.map(([x, y]) => [x + by[0], y + by[1]]));
    }
    this.on.change(this.site);
    this.showShapes();
  }

  up(place, event, moved) {
    if (!this.open) return;
    const { drag } = this;
    this.drag = null;
    if (this.tool === "select") {
      if (drag?.before && JSON.stringify(this.site) !== drag.before) {
        this.done.push(drag.before);
        this.undone = [];
        this.show();
      }
      return;
    }
    if (this.draft?.rectangle) {
      const points = this.draft.rectangle;
      return points[0][0] !== points[2][0] && points[0][1] !== points[2][1] ? this.finish(points) : this.use(this.tool);
    }
    if (event.type === "pointercancel") return;
    const point = this.snap(place);
    this.draft ??= { points: [] };
    const first = this.draft.points[0], { least, most, closed } = KINDS[this.tool];
    const again = (other) => other && Math.hypot(other[0] - point[0], other[1] - point[1]) < CLOSE_PX * this.view.px / 2;
    if (this.draft.points.length >= least && (again(this.draft.points.at(-1)) || (closed && again(first)))) return this.finish();
    if (again(this.draft.points.at(-1))) return;
    this.draft.points.push(point);
    if (this.draft.points.length === most) this.finish(); else this.show();
  }

  finish(points = this.draft?.points) {
    if (!points || points.length < KINDS[this.tool].least) return;
    this.note();
    const kind = this.tool;
    this.site[kind] = [...(this.site[kind] ?? []), create(kind, points, this.site)];
    this.draft = null;
    this.tool = "select";
    this.view.svg.classList.remove("drawing");
    this.choose({ kind, index: this.site[kind].length - 1 });
    const name = document.getElementById("part-name");
    if (name && matchMedia("(pointer: fine)").matches) { name.focus(); name.select(); }
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
    else if (ctrl && key === "z") event.shiftKey ? this.back(this.undone, this.done) : this.back(this.done, this.undone);
    else if (ctrl && key === "y") this.back(this.undone, this.done);
    else if (key === "escape") this.draft || this.tool !== "select" ? this.use("select") : this.choose(null);
    else if (key === "enter" && this.draft) this.finish();
    else if ((key === "delete" || key === "backspace") && this.part(this.chosen)) this.remove();
    else if (step && this.part(this.chosen) && event.target.closest?.(".shape")) {
      this.note();
      const { kind } = this.chosen, part = this.part(this.chosen);
      setCorners(kind, part, corners(kind, part).map(([x, y]) => [x + step[0] * GRID_M, y + step[1] * GRID_M]));
      this.choose(this.chosen);
    } else return;
    event.preventDefault();
  }

  /** What is chosen, to be typed; and what becomes of it all. */
  form() {
    const part = this.part(this.chosen), fields = [];
    const change = (does) => (event) => { this.note(); does(event.target); this.show(); };
    const text = (label, key, extra = {}) => fields.push(html("label", {}, label, html("input",
      { value: part[key], id: `part-${key}`, maxLength: 64, onchange: change((input) => { this.rename(part, key, input.value.trim()); }), ...extra })));
    const number = (label, key, unit) => fields.push(html("label", {}, label, html("input", { type: "number", step: "any", value: part[key], id: `part-${key}`,
      ariaLabel: `${label}, ${unit}`, onchange: change((input) => { if (Number.isFinite(input.valueAsNumber)) part[key] = input.valueAsNumber; }) })));
    const tick = (label, get, set) => fields.push(html("label", { className: "tick" }, html("input", { type: "checkbox", checked: get(), onchange: change((input) => set(input.checked)) }), label));
    if (part) {
      const { kind } = this.chosen;
      if (kind !== "wall") text("Name", "name");
      if (kind === "zone") {
        tick("Count people in it", () => part.count, (on) => { part.count = on; });
        tick("Enclosed by walls and entries", () => part.enclosed, (on) => { part.enclosed = on; });
        tick("Secure: whoever is unexplained counts too", () => part.secure, (on) => { part.secure = on; });
      }
      if (kind === "wall") {
        tick("Glass: stops people, lets beams through", () => !part.blocks.includes("beams"), (on) => { part.blocks = on ? ["people"] : ["people", "beams"]; });
        tick("Mirror", () => part.mirror, (on) => { part.mirror = on; });
      }
      if (kind === "entry") {
        const choice = html("select", { onchange: change((input) => { part.zone = input.value || null; }) }, html("option", { value: "" }, "the one that counts"),
          ...(this.site.zone ?? []).map(({ name }) => html("option", { value: name, selected: part.zone === name }, name)));
        fields.push(html("label", {}, "Leads to", choice));
      }
      if (kind === "module") for (const [label, key, unit] of [["x", "x", "m"], ["y", "y", "m"], ["Turned", "yaw_deg", "degrees"], ["Height", "height_m", "m"]]) number(`${label} (${unit === "degrees" ? "°" : unit})`, key, unit);
      fields.push(html("button", { type: "button", className: "button danger", id: "remove", onclick: () => this.remove() }, `Remove this ${KINDS[kind].word.toLowerCase()}`));
    }
    const title = part ? KINDS[this.chosen.kind].word : "Edit the site";
    const save = html("button", { type: "button", className: "button main", id: "save", disabled: this.saving || !this.changed(), onclick: () => this.save() }, "Save");
    const cancel = html("button", { type: "button", className: "button", id: "cancel", onclick: () => this.cancel() }, this.changed() ? "Discard" : "Done");
    const form = html("section", { className: "detail form" }, html("header", {}, html("h2", {}, title)),
      ...(part ? fields : [html("p", { className: "fine" }, "Choose a shape on the map, or draw a new one.")]),
      html("p", { className: "error", id: "edit-error", role: "alert", hidden: !this.error }, this.error),
      html("div", { className: "row" }, cancel, save),
      html("p", { className: "fine" }, `Saves to ${this.file}. Comments in that file are not kept. People are found anew when the site changes.`));
    return form;
  }

  /** Entries follow the name of their zone. */
  rename(part, key, name) {
    if (key === "name" && this.chosen.kind === "zone")
      for (const entry of this.site.entry ?? []) if (entry.zone === part.name) entry.zone = name;
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
