// The plan that modules have measured: its walls, rooms and entries on the map, to be named, left out or accepted.

import { KIND } from "./names.js";
import { ask } from "./net.js";
import { called, html, middle, path, svg } from "./shapes.js";
import { changeSite } from "./site-file.js";
import { metres, say, squareMetres, tell } from "./words.js";

const length = (points) =>
  points.slice(1).reduce(
    (sum, [x, y], index) => sum + Math.hypot(x - points[index][0], y - points[index][1]),
    0,
  );

function area(polygon) {
  return Math.abs(polygon.reduce((sum, [x, y], index) => {
    const [ax, ay] = polygon.at(index - 1);
    return sum + ax * y - x * ay;
  }, 0)) / 2;
}

/** All that is proposed, with which of it is wanted and how it is called. */
function parts({ wall, zone, entry }) {
  const part = (kind, one, text) => ({ kind, one, text, wanted: true, name: one.name });
  return [
    ...zone.map((one) => part(KIND.ZONE, one, squareMetres(area(one.polygon)))),
    ...entry.map((one) =>
      part(KIND.ENTRY, one, say("survey.entry-into", { length: metres(length(one.line), 1), zone: one.zone }))
    ),
    ...wall.map((one) => part(KIND.WALL, one, say("survey.wall", { length: metres(length(one.points), 1) }))),
  ];
}

export class Survey {
  /** `on.form` with an element for the panel or null; `on.close(saved)` when it is over; `on.bounds` with the corners of all. */
  constructor(layer, on) {
    Object.assign(this, { layer, on, open: false, parts: [] });
    this.said = html("p", { role: "status", id: "survey-said" });
    this.error = html("p", { className: "error", role: "alert", hidden: true });
    this.list = html("ul", { className: "survey-parts" });
    this.accept = html("button", {
      id: "survey-accept",
      type: "button",
      className: "button main",
      onclick: () => this.save(),
    }, say("survey.accept"));
    const close = html(
      "button",
      { id: "survey-close", type: "button", className: "button", onclick: () => this.close(false) },
      say("survey.close"),
    );
    this.form = html(
      "section",
      { className: "detail survey", id: "survey" },
      html("header", {}, html("h2", {}, say("survey.title"))),
      this.said,
      html("div", { className: "row" }, this.accept, close),
      this.error,
      this.list,
    );
    this.form.setAttribute("aria-label", say("survey.label"));
  }

  async start() {
    this.open = true;
    this.parts = [];
    this.fail(null);
    this.say(say("survey.looking"));
    this.list.replaceChildren();
    this.layer.replaceChildren();
    this.accept.disabled = true;
    this.on.form(this.form);
    try {
      const found = await ask("/api/survey");
      if (!this.open) return;
      this.parts = parts(found);
      this.show();
    } catch (error) {
      this.say("");
      this.fail(error);
    }
  }

  say(text) {
    this.said.textContent = text;
  }

  fail(error) {
    tell(this.error, error);
  }

  show() {
    const count = (kind, key) => {
      const n = this.parts.filter((part) => part.kind === kind).length;
      return n ? say(key, { n }) : "";
    };
    const all = [
      count(KIND.ZONE, "survey.rooms"),
      count(KIND.ENTRY, "survey.entries"),
      count(KIND.WALL, "survey.walls"),
    ].filter(Boolean);
    this.say(
      all.length ? say("survey.found", { parts: all.join(", ") }) : say("survey.nothing"),
    );
    this.accept.disabled = !all.length;
    this.list.replaceChildren(...this.parts.map((part) => this.row(part)));
    this.draw();
    this.on.bounds(this.parts.flatMap(({ one }) => one.polygon ?? one.line ?? one.points));
  }

  row(part) {
    const alike = this.parts.filter(({ kind }) => kind === part.kind);
    const label = called(part.kind, part, alike.indexOf(part));
    const wanted = html("input", {
      type: "checkbox",
      checked: true,
      "aria-label": say("survey.take", { part: label }),
      onchange: () => {
        part.wanted = wanted.checked;
        this.draw();
      },
    });
    const name = part.name === undefined ? "" : html("input", {
      value: part.name,
      maxLength: 60,
      autocomplete: "off",
      "aria-label": say("survey.name", { part: label }),
      oninput: () => {
        part.name = name.value;
        this.draw();
      },
    });
    return html("li", { dataset: { kind: part.kind } }, wanted, name, html("span", {}, part.text));
  }

  draw() {
    const shape = ({ kind, one, name, wanted }) => {
      const points = one.polygon ?? one.line ?? one.points;
      const shown = svg("path", {
        class: `survey-${kind}${wanted ? "" : " unwanted"}`,
        d: path(points, kind === KIND.ZONE),
      });
      if (kind !== KIND.ZONE) return [shown];
      const [x, y] = middle(points);
      const text = svg("text", { x, y: -y, "text-anchor": "middle", class: "survey-name" });
      text.textContent = wanted ? name : "";
      return [shown, text];
    };
    this.layer.replaceChildren(...this.parts.flatMap(shape));
  }

  async save() {
    this.accept.disabled = true;
    this.fail(null);
    const { parts } = this;
    // Closed meanwhile, and perhaps opened anew, the map and the panel are another's.
    const isOurs = () => this.open && this.parts === parts;
    const zoneNames = new Map(
      this.parts.filter(({ kind }) => kind === KIND.ZONE).map(({ one, name }) => [one.name, name.trim()]),
    );
    const wanted = this.parts.filter((part) => part.wanted);
    const zones = new Set(wanted.filter(({ kind }) => kind === KIND.ZONE).map(({ name }) => name.trim()));
    try {
      await changeSite((site) => {
        for (const { kind, one, name } of wanted) {
          const part = { ...one };
          if (name !== undefined) part.name = name.trim();
          if (kind === KIND.ENTRY) {
            part.zone = zoneNames.get(one.zone) ?? one.zone;
            // An entry of a room that is left out leads nowhere.
            if (!zones.has(part.zone)) continue;
          }
          site[kind] = [...(site[kind] ?? []), part];
        }
      });
      if (isOurs()) this.close(true);
    } catch (error) {
      if (!isOurs()) return;
      this.fail(error);
      this.accept.disabled = false;
    }
  }

  close(saved) {
    this.open = false;
    this.layer.replaceChildren();
    this.on.form(null);
    this.on.close(saved);
  }
}
