// Why a figure is what it is: asked again each second while it is shown, with what is not seen hatched on the map.

import { ask } from "./net.js";
import { countedZones, html, isCounted, svg } from "./shapes.js";
import { lines } from "./why-words.js";
import { say, word } from "./words.js";

const AGAIN_MS = 1000;

/** What is asked, as a query, and as a title. */
const query = (kind, name) => `/api/explain?${kind}=${encodeURIComponent(name)}`;
const title = (kind, name) =>
  kind === "total"
    ? say("why.total")
    : say(`why.${kind}`, { name: kind === "alarm" ? word("alarm", name) : String(name) });

export class Why {
  /** `layer`: of the map, for what is not seen. */
  constructor(layer) {
    this.layer = layer;
    this.of = null;
    this.heading = html("h2");
    this.list = html("ul", { className: "why-list" });
    const close = html("button", {
      className: "close",
      type: "button",
      "aria-label": say("why.close"),
      onclick: () => this.open(null),
    }, "×");
    this.root = html(
      "section",
      { className: "detail why", id: "why", hidden: true, "aria-label": say("why.label") },
      html("header", {}, this.heading, close),
      this.list,
    );
    setInterval(() => this.of && !document.hidden && this.load(), AGAIN_MS);
  }

  /** Explains {zone}, {line}, {person}, {alarm} or {total: true}; nothing with null. */
  open(of) {
    const focused = this.root.contains(document.activeElement);
    if (!of && focused) this.opener?.focus();
    if (of && !focused) this.opener = document.activeElement;
    this.of = of;
    this.root.hidden = !of;
    this.layer.replaceChildren();
    this.list.replaceChildren();
    delete this.list.dataset.text;
    if (!of) return;
    this.heading.textContent = title(...Object.entries(of)[0]);
    this.load();
    if (!of.person) this.root.scrollIntoView({ block: "nearest" });
  }

  /** The newest frame and the site, for the sum of all zones; `past`: the page looks back, and the tracker knows reasons of now only. */
  frame(site, line, past) {
    const turned = past !== this.past;
    Object.assign(this, { site, line, past });
    if (turned && this.of) this.load();
  }

  async load() {
    const of = this.of;
    if (this.past) {
      this.mark(null);
      return this.show([{ text: say("why.past") }]);
    }
    if (of.total) return this.total();
    const [[kind, name]] = Object.entries(of);
    const answer = await ask(query(kind, name)).catch((error) => error);
    // Meanwhile something else may have been asked.
    if (this.of !== of || this.past) return;
    const failed = answer instanceof Error;
    this.show(failed ? [{ text: answer.message, lang: answer.isOfTracker && "en" }] : lines(answer));
    this.mark(failed ? null : answer.zone);
  }

  /** Every zone that counts, each with a button to its own reasons. */
  total() {
    const names = countedZones(this.site ?? {});
    const each = names.map((name) => {
      const zone = this.line?.zones?.[name];
      const text = isCounted(zone)
        ? say("why.zone-count", { zone: name, count: zone.count })
        : say("why.zone-unknown", { zone: name });
      return { text, zone: name };
    });
    this.show(each.length ? [{ text: say("why.sum") }, ...each] : [{ text: say("why.no-zones") }]);
  }

  /** Lines: a text, its language if it is another one, the zone it leads to, and whether it is a part of the one before. */
  show(all) {
    const text = JSON.stringify(all);
    if (this.list.dataset.text === text) return;
    this.list.dataset.text = text;
    // A button that is replaced loses the focus.
    const focused = [...this.list.children].findIndex((item) => item.contains(document.activeElement));
    this.list.replaceChildren(...all.map(({ text, lang, zone, part }) => {
      const inner = zone === undefined ? text : html("button", {
        type: "button",
        className: "link-like",
        onclick: () => this.open({ zone }),
      }, text);
      return html("li", { className: part ? "part" : "", ...(lang ? { lang } : {}) }, inner);
    }));
    if (focused >= 0) this.list.children[focused]?.querySelector("button")?.focus();
  }

  /** Hatches what of a zone is not seen. */
  mark(zone) {
    const half = (zone?.cell_m ?? 0) / 2;
    const square = ([x, y]) => `M${x - half} ${-(y - half)}h${2 * half}v${-2 * half}h${-2 * half}z`;
    const patches = (zone?.unseen ?? []).map(({ cells, why }) =>
      svg("path", { class: "unseen-patch", d: cells.map(square).join(""), "data-why": why.is })
    );
    this.layer.replaceChildren(...patches);
  }
}
