// What the map leads to: the report, the handover page, firmware; and where people were within the last day, as a layer.

import { now } from "./clock.js";
import { drawHeat, square } from "./heat.js";
import { ask } from "./net.js";
import { html } from "./shapes.js";
import { age, offer, say, tell } from "./words.js";

const DAY_MS = 86_400_000;
const AGAIN_MS = 60_000;

export class More {
  /** `layer`: of the map. */
  constructor(layer) {
    this.layer = layer;
    this.words = html("p", { className: "fine", id: "heat-words", role: "status" });
    this.toggle = html("button", {
      className: "button",
      type: "button",
      id: "heat-toggle",
      "aria-pressed": "false",
      onclick: () => this.show(this.toggle.getAttribute("aria-pressed") !== "true"),
    }, say("more.heat"));
    const chooser = html("select", { className: "button", id: "language" });
    offer(chooser);
    this.root = html(
      "section",
      { className: "more", "aria-label": say("more.title") },
      html("h2", {}, say("more.title")),
      html(
        "div",
        { className: "row" },
        html("a", { className: "button", href: "/report" }, say("more.report")),
        html("a", { className: "button", href: "/handover" }, say("more.handover")),
        html("a", { className: "button", href: "/firmware" }, say("more.firmware")),
        this.toggle,
      ),
      this.words,
      chooser,
    );
    setInterval(() => this.shown && !document.hidden && this.load(), AGAIN_MS);
  }

  show(wanted) {
    this.shown = wanted;
    this.toggle.setAttribute("aria-pressed", String(wanted));
    this.layer.replaceChildren();
    this.words.textContent = "";
    if (wanted) this.load();
  }

  async load() {
    const to = Math.floor(now());
    const heat = await ask(`/api/heat?from=${to - DAY_MS}&to=${to}`).catch((error) => error);
    if (!this.shown) return;
    if (heat instanceof Error) tell(this.words, heat);
    else if (!heat.kept) this.words.textContent = say("report.not-kept");
    else {
      drawHeat(this.layer, heat, "hatch");
      const most = Math.max(0, ...heat.cells.filter((time) => time !== null));
      const told = { most: age(most), cell: square(heat.cell_m), hidden: age(heat.hidden_s) };
      this.words.textContent = say(heat.hidden_s >= 1 ? "more.heat-hidden" : "more.heat-words", told);
    }
  }
}
