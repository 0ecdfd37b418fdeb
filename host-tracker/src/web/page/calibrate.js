// The calibration view: tells the visitor where to walk, pair by pair; the result is shown on the map and accepted with a click.

import { WISH } from "./names.js";
import { ask } from "./net.js";
import { html, svg } from "./shapes.js";

const LOOK_MS = 500;
const SHADES = ["#3b82f633", "#3b82f666", "#3b82f699"]; // seen by one, two, more
const AREAS = 4; // the largest, in words; all are on the map
const shade = (modules) => SHADES[Math.min(modules.length, SHADES.length) - 1];

export class Calibration {
  /** `on.form` with an element for the panel or null, `on.close` when it is over. */
  constructor(layer, on) {
    Object.assign(this, { layer, on, open: false, text: "" });
    this.advice = html("p", { className: "walk-advice", id: "calibrate-advice", role: "status" });
    this.sees = html("p", { className: "walk-sees" });
    this.bar = html("div", { className: "meter" }, html("i"));
    this.pairs = html("ul", { className: "walk-pairs", id: "calibrate-pairs" });
    this.result = html("div", { id: "calibrate-result" });
    const button = (id, text, wish) =>
      html("button", { id, type: "button", className: "button", onclick: () => this.wish(wish) }, text);
    this.finish = button("calibrate-finish", "Work it out", WISH.FINISH);
    this.again = button("calibrate-again", "Walk on", WISH.GO_ON);
    this.accept = button("calibrate-accept", "Accept and save", WISH.ACCEPT);
    this.stop = button("calibrate-stop", "Stop", WISH.STOP);
    this.form = html(
      "section",
      { className: "detail walk", id: "calibrate" },
      html("header", {}, html("h2", {}, "Find the modules by walking")),
      this.advice,
      this.sees,
      this.bar,
      this.pairs,
      this.result,
      html("div", { className: "walk-buttons" }, this.finish, this.again, this.accept, this.stop),
    );
    this.form.setAttribute("aria-label", "Calibration");
  }

  start() {
    this.open = true;
    this.on.form(this.form);
    this.wish(WISH.BEGIN);
    this.timer = setInterval(() => this.look(), LOOK_MS);
  }

  async wish(what) {
    try {
      const answer = await ask("/api/calibration", {
        method: "POST",
        headers: { "Content-Type": "application/json" },
        body: JSON.stringify({ do: what }),
      });
      if (what === WISH.ACCEPT || what === WISH.STOP) this.close(what === WISH.ACCEPT);
      else this.show(answer);
    } catch (error) {
      this.advice.textContent = error.message;
    }
  }

  async look() {
    try {
      this.show(await ask("/api/calibration"));
    } catch (error) {
      this.advice.textContent = error.message;
    }
  }

  close(saved) {
    clearInterval(this.timer);
    this.open = false;
    this.layer.replaceChildren();
    this.on.form(null);
    this.on.close(saved);
  }

  show(status) {
    if (!this.open || !status.active) return;
    const done = Boolean(status.found || status.refused);
    const text = JSON.stringify(status);
    if (text === this.text) return;
    this.text = text;
    this.advice.textContent = status.refused ?? status.found?.quality ?? status.advice;
    this.advice.classList.toggle("alarm", Boolean(status.refused));
    this.form.dataset.state = status.found
      ? "found"
      : status.refused
      ? "refused"
      : status.enough
      ? "enough"
      : "walking";
    const crowd = status.crowded_s > 0.5
      ? ` ${status.crowded_s.toFixed(0)} s with several people are not used.`
      : "";
    this.sees.textContent = done
      ? ""
      : (status.sees.length ? `Seen by ${status.sees.join(", ")}.` : "No module sees you now.") + crowd;
    this.bar.hidden = done;
    this.bar.firstChild.style.width = `${Math.round(status.progress * 100)}%`;
    this.pairs.replaceChildren(...status.pairs.map(({ modules, common_s, needed_s, residual_m }) => {
      const share = Math.min(common_s / needed_s, 1);
      const words = residual_m != null
        ? `${(residual_m * 100).toFixed(0)} cm apart`
        : `${Math.min(common_s, needed_s).toFixed(0)} of ${needed_s} s`;
      return html(
        "li",
        { className: share >= 1 ? "done" : "" },
        html("strong", {}, modules.join(" + ")),
        html("em", {}, words),
        html("div", { className: "meter" }, html("i", { style: `width:${Math.round(share * 100)}%` })),
      );
    }));
    this.result.replaceChildren(...(status.found?.modules ?? []).map((module) => html("p", {}, module.text)));
    if (status.found) {
      const { seen_m2: [one, two], areas } = status.found.coverage;
      this.result.append(
        html("p", {}, `At least one module sees ${one.toFixed(0)} m², two see ${two.toFixed(0)} m².`),
        html(
          "ul",
          { className: "walk-areas" },
          ...areas.slice(0, AREAS).map(({ modules, m2 }) =>
            html(
              "li",
              {},
              html("i", { style: `background:${shade(modules)}` }),
              `${modules.join(" + ")}: ${m2.toFixed(1)} m²`,
            )
          ),
        ),
      );
    }
    this.finish.hidden = done;
    this.again.hidden = !done;
    this.accept.hidden = !status.found;
    this.draw(status);
  }

  /** Draws the place to walk to, the poses found with their uncertainty, and the coverage of each set of modules. */
  draw(status) {
    const parts = [];
    const coverage = status.found?.coverage;
    if (coverage) {
      const { x, y, cell_m, columns, seen_by, areas } = coverage;
      const cells = areas.map(() => []);
      seen_by.forEach((area, index) => {
        const at = [x + (index % columns) * cell_m, y + Math.floor(index / columns) * cell_m];
        cells[area - 1]?.push(`M${at[0]} ${-at[1]}h${cell_m}v${-cell_m}h${-cell_m}z`);
      });
      areas.forEach(({ modules }, index) => {
        const path = svg("path", { d: cells[index].join(""), fill: shade(modules), class: "coverage" });
        const title = svg("title", {});
        title.textContent = `Seen by ${modules.join(", ")}`;
        path.append(title);
        parts.push(path);
      });
    }
    for (const module of status.found?.modules ?? []) {
      const rad = (module.yaw_deg * Math.PI) / 180,
        tip = [module.x + 0.5 * Math.cos(rad), module.y + 0.5 * Math.sin(rad)];
      parts.push(
        svg("circle", {
          class: "walk-within",
          cx: module.x,
          cy: -module.y,
          r: Math.max(module.within_m, 0.04),
        }),
        svg("path", { class: "walk-yaw", d: `M${module.x} ${-module.y}L${tip[0]} ${-tip[1]}` }),
        svg(
          "text",
          { class: "walk-name", x: module.x, y: -module.y, dy: "-.8em", "text-anchor": "middle" },
          module.name,
        ),
      );
    }
    if (status.place && !status.found) {
      parts.push(svg("circle", { class: "walk-here", cx: status.place[0], cy: -status.place[1], r: 0.35 }));
    }
    this.layer.replaceChildren(...parts);
  }
}
