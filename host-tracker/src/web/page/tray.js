// The tray on the map: modules that wait for their place, what each sees in its own frame, and what is to be done next.

import { alarmText } from "./alarm-words.js";
import { MODULE } from "./names.js";
import { askModule } from "./net.js";
import { answering, STAGE, stage, strangers, unplaced, words } from "./next.js";
import { html, path, put, svg } from "./shapes.js";
import { changeSite } from "./site-file.js";
import { mayAskModules, mayChangeSite } from "./who.js";
import { metres, percent, say, tell, word } from "./words.js";

const NEAR_M = 3; // half of the picture of what a module sees
const SEEN_MS = 600; // for so long a module stays lit

/** A module in the tray: its name, how it is, and what it sees. */
class Card {
  constructor(name, tray) {
    Object.assign(this, { name, tray, seen: 0 });
    this.free = svg("path", { class: "tray-free" });
    this.bodies = svg("g", { class: "tray-bodies" });
    const view = svg(
      "svg",
      { viewBox: `${-NEAR_M} ${-NEAR_M} ${2 * NEAR_M} ${2 * NEAR_M}`, "aria-hidden": "true" },
      this.free,
      svg("path", { class: "tray-cone", d: "M0 0L.45 .25V-.25Z" }),
      this.bodies,
    );
    this.field = html("input", {
      value: name,
      maxLength: 32,
      required: true,
      autocomplete: "off",
      spellcheck: false,
      "aria-label": say("tray.name", { name }),
      onchange: () => this.rename(),
      onkeydown: ({ key }) => key === "Enter" && this.field.blur(),
    });
    this.title = html("strong", {}, name);
    this.state = html("p", { className: "tray-state", role: "status" });
    this.meter = html("div", { className: "meter" }, html("i"));
    this.who = html("p", { className: "fine" });
    this.alarm = html("p", { className: "fine tray-alarm" });
    this.use = html(
      "button",
      { type: "button", className: "button", onclick: () => tray.take([this.name]) },
      say("tray.use"),
    );
    this.blink = html("button", {
      type: "button",
      className: "button",
      title: say("look.blink-title"),
      onclick: () => tray.does(() => askModule(this.name, "identify", {})),
    }, say("look.blink"));
    this.leave = html("button", {
      type: "button",
      className: "button",
      title: say("tray.leave-title"),
      onclick: () => tray.drop(this.name),
    }, say("tray.leave"));
    this.root = html(
      "li",
      { className: "tray-card" },
      view,
      html(
        "div",
        {},
        this.title,
        this.field,
        this.state,
        this.meter,
        this.who,
        html("div", { className: "row" }, this.use, this.blink, this.leave),
        this.alarm,
      ),
    );
  }

  /** `line` of the newest frame; `waits`: the site has it already. */
  show(line, waits) {
    this.field.hidden = !waits;
    this.title.hidden = waits;
    this.leave.hidden = !waits || !mayChangeSite();
    this.use.hidden = waits || !mayChangeSite();
    this.field.disabled = !mayAskModules();
    this.blink.hidden = !line || !mayAskModules();
    const sees = line?.sees ?? [];
    const now = performance.now();
    if (sees.length) this.seen = now;
    const lit = now - this.seen < SEEN_MS && this.seen > 0;
    this.root.classList.toggle("lit", lit);
    const nearest = Math.min(...sees.map(([x, y]) => Math.hypot(x, y)));
    const share = line?.learned_share;
    const state = !line
      ? word("module", MODULE.MISSING)
      : line.state === MODULE.FOUND
      ? word("module", MODULE.FOUND)
      : share != null
      ? say("tray.learns", { share: percent(share) })
      : line.state === MODULE.WATCHING && lit
      ? Number.isFinite(nearest)
        ? say("tray.sees-you-at", { range: metres(nearest, 1) })
        : say("tray.sees-you")
      : line.state === MODULE.WATCHING
      ? say("tray.sees-nobody")
      : word("module", line.state);
    put(this.state, state);
    // Nothing moves under the pointer.
    this.meter.style.visibility = share == null ? "hidden" : "visible";
    this.meter.firstChild.style.width = `${Math.round((share ?? 0) * 100)}%`;
    const who = [line?.id, line?.address].filter(Boolean).join(" · ");
    put(this.who, who);
    const alarm = line?.alarms.length ? alarmText(line.alarms[0]) : "";
    put(this.alarm, alarm);
    this.bodies.replaceChildren(...sees.map(([x, y]) => svg("circle", { cx: x, cy: -y, r: 0.25 })));
  }

  /** Gives it the name in its field, there and in the site. */
  async rename() {
    const to = this.field.value.trim();
    if (!to || to === this.name) return (this.field.value = this.name);
    await this.tray.does(async () => {
      const answer = await askModule(this.name, "rename", { name: to });
      this.tray.renamed(this.name, to);
      return answer;
    });
  }
}

export class Tray {
  /** `on.walk`, `on.plan` and `on.draw` begin these; `on.site(revision)` after the site has changed. */
  constructor(root, on) {
    Object.assign(this, { root, on, cards: new Map(), busy: Promise.resolve(), site: {}, lines: [] });
    this.title = html("h2", {});
    this.more = html("p", {});
    this.list = html("ul", {});
    this.firmware = html("a", { className: "button", href: "/firmware" }, say("tray.firmware"));
    this.error = html("p", { className: "error", role: "alert", hidden: true });
    this.button = html("button", {
      id: "next",
      type: "button",
      className: "button main",
      onclick: () => this.next(),
    });
    root.append(
      this.title,
      this.more,
      html("div", { className: "row" }, this.button, this.firmware),
      this.error,
      this.list,
    );
  }

  /** Shows what waits, by the site and the modules of a frame; `known`: whether they are of now. */
  show(site, lines, known) {
    Object.assign(this, { site, lines });
    const waits = new Set(unplaced(site).map(({ name }) => name));
    const found = strangers(site, lines).map(({ name }) => name);
    const next = words(site, lines);
    this.root.hidden = !known || !(next || found.length);
    if (this.root.hidden) return;
    put(this.title, next?.title ?? say("tray.strangers", { n: found.length }));
    put(this.more, next?.more ?? "");
    put(this.button, next?.button ?? "");
    const now = this.root.dataset.stage = stage(site, lines);
    this.button.hidden = !next ||
      !(now === STAGE.UNLEARNED ? mayAskModules() && answering(site, lines).length : mayChangeSite());
    this.firmware.hidden = now !== STAGE.ALONE;
    const names = [...waits, ...found];
    for (const [name, card] of this.cards) {
      if (names.includes(name)) continue;
      card.root.remove();
      this.cards.delete(name);
    }
    names.forEach((name, index) => {
      let card = this.cards.get(name);
      if (!card) this.cards.set(name, card = new Card(name, this));
      if (this.list.children[index] !== card.root) {
        this.list.insertBefore(card.root, this.list.children[index] ?? null);
      }
      card.show(lines.find((line) => line.name === name), waits.has(name));
    });
  }

  /** What modules see, each in its own frame as long as it is not placed. */
  fields(fields) {
    for (const [name, card] of this.cards) card.free.setAttribute("d", path(fields[name] ?? [], true));
  }

  renamed(from, to) {
    const card = this.cards.get(from);
    if (!card) return;
    this.cards.delete(from);
    card.name = card.field.value = to;
    card.title.textContent = to;
    card.field.setAttribute("aria-label", say("tray.name", { name: to }));
    this.cards.set(to, card);
  }

  /** Does something that may fail, and says why; one thing at a time: a name that is typed meanwhile waits for its turn. */
  does(what) {
    tell(this.error, null);
    return this.busy = this.busy.then(() => this.done(what));
  }

  /** Its answer has a revision if the site is another now. */
  async done(what) {
    this.button.disabled = true;
    try {
      const { revision } = await what() ?? {};
      if (revision !== undefined) await this.on.site(revision);
    } catch (error) {
      tell(this.error, error);
    } finally {
      this.button.disabled = false;
    }
  }

  /** These modules belong to the site from now on; where they are is not known yet. */
  take(names) {
    return this.does(() =>
      changeSite((site) => {
        const known = new Set((site.module ?? []).map(({ name }) => name));
        const fresh = names.filter((name) => !known.has(name));
        site.module = [
          ...(site.module ?? []),
          ...fresh.map((name) => ({ name, x: 0, y: 0, placed: false })),
        ];
      })
    );
  }

  /** A module does not belong to the site. */
  drop(name) {
    return this.does(() =>
      changeSite((site) => {
        site.module = (site.module ?? []).filter((module) => module.name !== name);
      })
    );
  }

  /** Does what is next. */
  next() {
    switch (stage(this.site, this.lines)) {
      case STAGE.ALONE:
        return this.on.draw();
      case STAGE.FOUND:
        return this.take(strangers(this.site, this.lines).map(({ name }) => name));
      case STAGE.UNLEARNED:
        return this.does(async () => {
          // One that does not answer keeps no other from learning.
          for (const { name } of answering(this.site, this.lines)) await askModule(name, "learn", {});
        });
      case STAGE.UNPLACED:
        return this.on.walk();
      case STAGE.NO_ZONE:
        return this.on.plan();
    }
  }
}
