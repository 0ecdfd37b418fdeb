// The picture under the map, a floor plan: uploaded, scaled by two points, put on two places of the map, or by numbers.

import { ask, send } from "./net.js";
import { begun, laid, NUMBERS, scaled, toPixel, toSite } from "./picture-place.js";
import { html, svg } from "./shapes.js";
import { say, tell } from "./words.js";

const CLICK_PX = 5; // what moves farther was a drag
const TYPES = { png: "image/png", svg: "image/svg+xml" };

/** A number as its field has it, to a thousandth. */
const inField = (number) => String(Math.round(number * 1000) / 1000);

/** What is clicked for: two points of the picture, then perhaps two places of the map. */
const HINTS = ["picture.hint-0", "picture.hint-1", "picture.hint-2", "picture.hint-3"];

export class Picture {
  /** `on.form` with an element for the panel or null; `on.close` when it is over. */
  constructor(layer, view, on) {
    Object.assign(this, { layer, view, on, open: false, place: null, there: false, points: [], shown: 0 });
    this.image = svg("image", { class: "floor-plan", preserveAspectRatio: "none" });
    this.marks = svg("g", { class: "picture-marks" });
    layer.append(this.image, this.marks);
    this.said = html("p", { role: "status" });
    this.error = html("p", { className: "error", role: "alert", hidden: true });
    this.file = html("input", {
      type: "file",
      id: "picture-file",
      accept: ".png,.svg,image/png,image/svg+xml",
      onchange: () => this.upload(),
    });
    const button = (id, text, does) =>
      html("button", { id, type: "button", className: "button", onclick: does }, text);
    this.metres = html("input", {
      id: "picture-metres",
      type: "number",
      min: 0.01,
      step: "any",
      // Without a number nothing can be scaled.
      required: true,
      "aria-label": say("picture.metres"),
    });
    this.scaling = html(
      "form",
      { className: "row", hidden: true },
      this.metres,
      html("button", { className: "button main", id: "picture-scale" }, say("picture.scale")),
    );
    this.scaling.onsubmit = (event) => {
      event.preventDefault();
      this.lay(scaled(this.place, this.points, Number(this.metres.value)));
    };
    this.numbers = [];
    const number = (key, label) => {
      const input = html("input", {
        id: `picture-${key}`,
        type: "number",
        step: "any",
        onchange: () => this.take(input, NUMBERS[key]),
      });
      this.numbers.push([input, NUMBERS[key].of]);
      return html("label", {}, label, input);
    };
    this.fields = html(
      "div",
      { className: "form picture-numbers" },
      number("x", say("picture.x")),
      number("y", say("picture.y")),
      number("turn", say("picture.turn")),
      number("wide", say("picture.wide")),
    );
    this.remove = button("picture-remove", say("picture.remove"), () => this.drop());
    this.form = html(
      "section",
      { className: "detail picture", id: "picture" },
      html("header", {}, html("h2", {}, say("picture.title"))),
      html("label", { for: "picture-file" }, say("picture.file")),
      this.file,
      this.said,
      this.scaling,
      this.error,
      this.fields,
      html(
        "div",
        { className: "row" },
        button("picture-done", say("picture.done"), () => this.close()),
        this.remove,
      ),
    );
    this.form.setAttribute("aria-label", say("picture.label"));
    let pressed = null;
    view.svg.addEventListener("pointerdown", (event) => pressed = [event.clientX, event.clientY]);
    view.svg.addEventListener("click", (event) => {
      const far = pressed && Math.hypot(event.clientX - pressed[0], event.clientY - pressed[1]);
      if (this.open && this.place && far !== null && far < CLICK_PX) this.click(view.place(event));
    });
  }

  /** Takes in a number that was typed. */
  take(input, { of, change }) {
    const number = input.valueAsNumber;
    // One that is emptied keeps its value.
    if (!Number.isFinite(number)) return input.value = inField(of(this.place));
    const changed = change(number, this.place);
    return changed
      ? this.lay({ ...this.place, ...changed }, true)
      : this.fail(new Error(say("picture.narrow")));
  }

  /** The page is being hidden or left, perhaps for good: a number that is being typed is taken in; its field keeps the focus. */
  leave() {
    const [field] = this.open ? this.numbers.find(([input]) => input === document.activeElement) ?? [] : [];
    field?.blur();
    field?.focus({ preventScroll: true });
  }

  /** Shows the picture that is kept, if there is one. */
  async load() {
    const answer = await ask("/api/picture/place").catch(() => null);
    if (!answer) return;
    this.there = answer.picture;
    this.place = answer.place;
    this.draw();
  }

  start() {
    this.open = true;
    this.again();
    this.on.form(this.form);
  }

  close() {
    this.open = false;
    this.points = [];
    this.draw();
    this.on.form(null);
    this.on.close();
  }

  /** Begins with the first point. */
  again() {
    this.points = [];
    this.target = null;
    this.fail(null);
    this.draw();
  }

  fail(error) {
    tell(this.error, error);
  }

  async does(what) {
    this.fail(null);
    try {
      await what();
    } catch (error) {
      this.fail(error);
    }
    this.draw();
  }

  upload() {
    const [file] = this.file.files;
    if (!file) return;
    return this.does(async () => {
      const type = TYPES[file.name.split(".").pop().toLowerCase()] ?? file.type;
      await ask("/api/picture", { method: "PUT", headers: { "Content-Type": type }, body: file });
      this.there = true;
      this.shown = Date.now();
      const image = new Image();
      image.src = this.source();
      await image.decode();
      // An SVG may have no size of its own.
      const size = [image.naturalWidth || 1000, image.naturalHeight || 1000];
      await this.keep(begun(size, this.view.shown()));
      this.points = [];
    });
  }

  /** Its address: another one for another picture. */
  source() {
    return `/api/picture?${this.shown}`;
  }

  async keep(place) {
    // A page that is left while this is under way has sent it all the same.
    await send("PUT", "/api/picture/place", place, {}, { keepalive: true });
    this.place = place;
  }

  lay(place, byNumber = false) {
    if (!place) return this.fail(new Error(say("picture.same")));
    return this.does(async () => {
      await this.keep(place);
      if (!byNumber) this.points = [];
      this.target = null;
    });
  }

  drop() {
    return this.does(async () => {
      await ask("/api/picture", { method: "DELETE" });
      this.there = false;
      this.place = null;
      this.points = [];
      this.file.value = "";
    });
  }

  /** A place of the map was clicked. */
  click(at) {
    if (this.points.length < 2) this.points.push(toPixel(this.place, at));
    else if (!this.target) this.target = at;
    else return this.lay(laid(this.place, this.points, [this.target, at]));
    this.draw();
  }

  draw() {
    const { place } = this;
    this.image.style.display = place ? "" : "none";
    if (place) {
      if (this.image.getAttribute("href") !== this.source()) this.image.setAttribute("href", this.source());
      this.image.setAttribute("width", place.width);
      this.image.setAttribute("height", place.height);
      this.image.setAttribute(
        "transform",
        `translate(${place.x} ${-place.y}) rotate(${-place.turn_deg}) scale(${place.m_per_px})`,
      );
    }
    const marks = this.open && place ? this.points.map((pixel) => toSite(place, pixel)) : [];
    if (this.open && this.target) marks.push(this.target);
    const r = 6 * this.view.px;
    this.marks.replaceChildren(...marks.map(([x, y]) => svg("circle", { cx: x, cy: -y, r })));
    const step = this.points.length + (this.target ? 1 : 0);
    this.said.textContent = say(
      place ? HINTS[step] : this.there ? "picture.broken" : "picture.none",
    );
    this.scaling.hidden = step !== 2;
    this.fields.hidden = !place;
    this.remove.hidden = !this.there;
    for (const [input, value] of this.numbers) {
      if (place && document.activeElement !== input) {
        input.value = inField(value(place));
      }
    }
  }
}
