// The side panel: the number of people, zone by zone, what happened, and the state of the modules.

import { alarmText } from "./alarm-words.js";
import { Alarms } from "./alarms.js";
import { Details } from "./details.js";
import { DoorPanel, doorsListed, passed } from "./doors.js";
import { More } from "./more.js";
import { ModuleActions } from "./module-actions.js";
import { focusHeading } from "./focus.js";
import { TRACK, ZONE } from "./names.js";
import { STAGE, stage, words as nextWords } from "./next.js";
import { words } from "./past.js";
import { countedZones, health, html, isCounted, isPlaced, people, put, total } from "./shapes.js";
import { Where } from "./where.js";
import { Why } from "./why.js";
import { clockTime, list, percent, say, word } from "./words.js";

const PASSAGES = 6;

/** Elements kept by key, so that focus stays where it is while figures change. */
function keyed(parent, keys, make, update) {
  const old = new Map([...parent.children].map((child) => [child.dataset.key, child]));
  keys.forEach((key, index) => {
    let child = old.get(key);
    if (!child) {
      child = make(key);
      child.dataset.key = key;
    }
    old.delete(key);
    if (parent.children[index] !== child) parent.insertBefore(child, parent.children[index] ?? null);
    update(child, key);
  });
  for (const child of old.values()) child.remove();
}

/** What stands beside the number of people. */
function headline(line, site, { count, open, past }) {
  if (line?.noTracker) return say("total.no-tracker");
  if (!open) return say(past ? "total.nothing-then" : "total.nothing");
  const zones = open.length > 2 ? say("total.zones", { n: open.length }) : list(open);
  if (count === null && !open.length) return say("total.no-module");
  if (count === null) return say(past ? "total.unknown-then" : "total.unknown", { zones });
  const occluded = people(line, site).filter((track) => track.state === TRACK.OCCLUDED).length;
  return [
    say(past ? "total.then" : "total.here", { n: count }),
    occluded ? say("total.occluded", { n: occluded }) : "",
    open.length ? say("total.open", { zones }) : "",
  ].join("");
}

/** How much of a zone is seen. */
function seen({ state, seen_share }) {
  return state === ZONE.UNKNOWN || seen_share === undefined || seen_share > 0.995
    ? word("zone", state)
    : say("zone.share", { share: percent(seen_share) });
}

export class Panel {
  /** `on.choose` with {module}, {door} or {person}, or null; `on.seek` with a time; `on.mark`, `on.unseen`, `on.heat`: layers of the map. */
  constructor(root, on) {
    this.why = new Why(on.unseen);
    on.why = (of) => this.why.open(of);
    this.more = new More(on.heat);
    this.actions = new ModuleActions(on);
    this.on = on;
    this.form = html("div", { hidden: true });
    this.number = html("b", { id: "total" }, "–");
    this.words = html("span");
    this.zones = html("div", { className: "cards", id: "zones" });
    this.alarms = new Alarms(on);
    this.zoneTitle = html("h2", {}, say("panel.zones"));
    this.where = new Where((chosen) => on.choose(chosen));
    this.doorPanel = new DoorPanel(on);
    this.details = new Details(() => on.choose(null));
    this.modules = html("ul", { className: "module-list", id: "modules" });
    this.measured = html("button", {
      id: "survey-open",
      type: "button",
      className: "button",
      title: say("panel.measured-title"),
      onclick: () => this.on.plan(),
    }, say("panel.measured"));
    this.picture = html("button", {
      id: "picture-open",
      type: "button",
      className: "button",
      title: say("panel.plan-title"),
      onclick: () => this.on.picture(),
    }, say("panel.plan"));
    this.events = html("ul", { className: "events", id: "events" });
    this.eventSection = html("section", { hidden: true }, html("h2", {}, say("panel.until")), this.events);
    this.doors = html("ul", { className: "events", id: "passages" });
    this.doorSection = html("section", { hidden: true }, html("h2", {}, say("panel.passages")), this.doors);
    this.figures = html(
      "div",
      { className: "cards", style: "gap:16px" },
      html(
        "div",
        { className: "total" },
        html("button", {
          className: "figure",
          type: "button",
          id: "total-why",
          title: say("why.ask"),
          onclick: () => on.why({ total: true }),
        }, this.number),
        this.words,
      ),
      this.alarms.root,
      this.where.root,
      this.details.root,
      this.why.root,
      this.actions.root,
      this.doorPanel.card,
      this.eventSection,
      this.doorPanel.list,
      this.doorSection,
      html("section", {}, this.zoneTitle, this.zones),
      html("section", {}, html("h2", {}, say("panel.modules")), this.modules, this.measured, this.picture),
      this.more.root,
    );
    root.append(this.form, this.figures);
  }

  /** Shows what is known: a frame or a line of history; `known`: whether that is worth anything now. `modules` and `doors`: as they
   * are now, none where that is not known; `passages`: doors with their passages. */
  show({ site, line, modules, doors, chosen, known, past, events, passages, names, frame }) {
    this.where.show(site, frame);
    this.why.frame(site, line, past);
    const { count, open } = known && line ? total(line, site, past ? null : modules) : { count: null };
    // With nothing to count in, it is said what is next, and never 0.
    const next = known && !past && !count && stage(site, modules) !== STAGE.READY && !(site.zone ?? []).length
      ? nextWords(site, modules).title
      : null;
    put(this.number, next || count === null ? "–" : String(count));
    this.number.parentElement.setAttribute(
      "aria-label",
      say("total.why", { people: this.number.textContent }),
    );
    put(this.words, next ?? headline(line, site, { count, open, past }));
    this.alarms.root.hidden = past;
    this.showZones(site, line?.zones ?? {}, known);
    this.showEvents(events);
    this.showPassages(passages);
    this.showModules(site, modules, past);
    this.measured.hidden = past || !(site.module ?? []).some(isPlaced);
    this.doorPanel.show({
      names: doorsListed(site, doors, past),
      lines: doors,
      states: passages,
      chosen,
    });
    const name = chosen?.module;
    this.actions.choose(
      name ?? null,
      (site.module ?? []).find((module) => module.name === name),
      // The connection may be lost for a moment while a form is open.
      past ? undefined : frame?.modules?.find((one) => one.name === name && one.address),
    );
    this.details.show(site, line, modules, chosen?.door ? null : chosen, names, known && !past);
  }

  showZones(site, zones, known) {
    const names = countedZones(site);
    this.zoneTitle.hidden = !names.length;
    keyed(
      this.zones,
      names,
      (name) =>
        html(
          "article",
          { className: "card zone-card" },
          html("h3", {}, name),
          html("button", {
            className: "figure",
            type: "button",
            title: say("why.ask"),
            onclick: () => this.on.why({ zone: name }),
          }, html("b", {}, "–")),
          html("p"),
          html("div", { className: "meter" }, html("i")),
        ),
      (card, name) => {
        const zone = known ? zones[name] : undefined;
        const unknown = !isCounted(zone);
        card.classList.toggle("unknown", unknown);
        const [, figure, words, meter] = card.children;
        figure.setAttribute(
          "aria-label",
          say("zone.figure", { zone: name, count: unknown ? say("zone.unknown-count") : zone.count }),
        );
        put(figure.firstChild, unknown ? say("zone.unknown-count") : String(zone.count));
        const sure = zone?.p?.[zone.count];
        put(
          words,
          !zone
            ? say("panel.no-news")
            : !unknown && sure !== undefined && sure < 0.995
            ? say("zone.sure", { seen: seen(zone), sure: percent(sure) })
            : seen(zone),
        );
        meter.hidden = zone?.seen_share === undefined;
        meter.title = meter.hidden ? "" : say("zone.share-now", { share: percent(zone.seen_share) });
        meter.firstChild.style.width = `${Math.round((zone?.seen_share ?? 0) * 100)}%`;
      },
    );
  }

  showEvents(events) {
    this.eventSection.hidden = !events.length;
    const key = (event) => `${event.at_ms} ${event.kind} ${event.subject} ${event.track}`;
    const byKey = new Map(events.map((event) => [key(event), event]));
    keyed(this.events, [...byKey.keys()], (name) => {
      const event = byKey.get(name), time = clockTime(event.at_ms);
      const row = html(
        "button",
        { type: "button", onclick: () => this.on.seek(event.at_ms) },
        html("time", {}, time),
        html("span", {}, words(event)),
      );
      row.dataset.kind = event.kind;
      return html("li", {}, row);
    }, () => {});
  }

  /** The last passages of all doors; each is a link to its time. */
  showPassages(doors) {
    const all = doors.flatMap((door) => door.passages).sort((a, b) => b.begun_ms - a.begun_ms).slice(
      0,
      PASSAGES,
    );
    this.doorSection.hidden = !all.length;
    const byKey = new Map(all.map((passed) => [`${passed.passage.door} ${passed.begun_ms}`, passed]));
    keyed(this.doors, [...byKey.keys()], (name) => {
      const { begun_ms, passage } = byKey.get(name),
        time = clockTime(begun_ms);
      const row = html(
        "a",
        {
          href: `#at=${begun_ms}`,
          title: say("panel.show-map"),
          onclick: () => this.on.seek(begun_ms),
        },
        html("time", {}, time),
        html(
          "span",
          {},
          say("door.passage-of", { door: passage.door, passage: passed(passage) }),
        ),
      );
      row.dataset.kind = passage.alarm ? "alarm" : "passage";
      return html("li", {}, row);
    }, () => {});
  }

  showModules(site, lines, past) {
    const byName = new Map(lines.map((line) => [line.name, line]));
    const names = [...new Set([...(site.module ?? []).map((module) => module.name), ...byName.keys()])];
    keyed(this.modules, names, (name) => {
      const row = html(
        "button",
        {
          className: "module-row",
          type: "button",
          onclick: () => this.on.choose({ module: name }),
        },
        html("i"),
        html("strong", {}, name),
        html("em"),
        html("p"),
      );
      return html("li", {}, row);
    }, (item, name) => {
      const row = item.firstChild, line = byName.get(name), [, , state, alarm] = row.children;
      row.dataset.health = health(line);
      put(state, past && !line ? "" : !line ? say("panel.no-news") : word("module", line.state));
      put(alarm, line?.alarms.length ? alarmText(line.alarms[0]) : "");
      alarm.hidden = !alarm.textContent;
    });
  }

  /** Shows a form in the place of the figures, or the figures again. */
  edit(form) {
    const opens = form && this.form.hidden;
    this.form.hidden = !form;
    this.figures.hidden = Boolean(form);
    // Whoever goes through fields and choices by keys goes on.
    const focused = document.activeElement, { id, selectionStart, selectionEnd } = focused;
    const stays = this.form.contains(focused) && focused.closest("select, button, input");
    const headed = this.form.contains(focused) && focused.tagName === "H2";
    this.form.replaceChildren(...(form ? [form] : []));
    // The button that opens a form is hidden then.
    if (form && (opens || headed)) focusHeading(form);
    else if (stays && id) {
      const field = document.getElementById(id);
      field?.focus({ preventScroll: true });
      if (typeof selectionStart === "number") field?.setSelectionRange?.(selectionStart, selectionEnd);
    }
  }
}
