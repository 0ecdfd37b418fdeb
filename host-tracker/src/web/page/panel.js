// The side panel: the number of people, zone by zone, what happened, and the state of the modules.

import { Details, percent } from "./details.js";
import { MODULE_WORDS, TRACK, ZONE, ZONE_WORDS } from "./names.js";
import { words } from "./past.js";
import { health, html, isCounted, people, total } from "./shapes.js";
import { Where } from "./where.js";

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

const put = (element, text) => {
  if (element.textContent !== text) element.textContent = text;
};

/** What stands beside the number of people. */
function headline(line, site, { count, open, past }) {
  if (line?.noTracker) return "no tracker ran then";
  const [then, of] = past ? ["then", "of then"] : ["here", "now"];
  if (!open) return `nothing is known ${of}`;
  const unknown = open.length > 2 ? `${open.length} zones` : open.join(" and ");
  if (count === null) return open.length ? `not known ${of}: ${unknown}` : "no module looks";
  const occluded = people(line, site).filter((track) => track.state === TRACK.OCCLUDED).length;
  return `${count === 1 ? "person" : "people"} ${then}${occluded ? `, ${occluded} of them occluded` : ""}${
    open.length ? `; not known: ${unknown}` : ""
  }`;
}

/** How much of a zone is seen. */
function seen({ state, seen_share }) {
  return state === ZONE.UNKNOWN || seen_share === undefined || seen_share > 0.995
    ? ZONE_WORDS[state]
    : `${percent(seen_share)} of it seen`;
}

export class Panel {
  /** `on.choose` with {module} or {person}, or null; `on.seek` with a time. */
  constructor(root, on) {
    this.on = on;
    this.form = html("div", { hidden: true });
    this.number = html("b", { id: "total" }, "–");
    this.words = html("span");
    this.zones = html("div", { className: "cards", id: "zones" });
    this.alarms = html("div", { className: "cards", id: "alarms", role: "alert" });
    this.zoneTitle = html("h2", {}, "Zones");
    this.where = new Where((chosen) => on.choose(chosen));
    this.details = new Details(() => on.choose(null));
    this.modules = html("ul", { className: "module-list", id: "modules" });
    this.events = html("ul", { className: "events", id: "events" });
    this.eventSection = html("section", { hidden: true }, html("h2", {}, "Until then"), this.events);
    this.doors = html("ul", { className: "events", id: "passages" });
    this.doorSection = html("section", { hidden: true }, html("h2", {}, "Passages"), this.doors);
    this.figures = html(
      "div",
      { className: "cards", style: "gap:16px" },
      html("div", { className: "total" }, this.number, this.words),
      this.alarms,
      this.where.root,
      this.details.root,
      this.eventSection,
      this.doorSection,
      html("section", {}, this.zoneTitle, this.zones),
      html("section", {}, html("h2", {}, "Modules"), this.modules),
    );
    root.append(this.form, this.figures);
  }

  /** Shows what is known: a frame or a line of history; `known`: whether that is worth anything now. */
  show({ site, line, alarmed, modules, chosen, known, past, events, doors, names, frame }) {
    this.where.show(site, frame);
    const { count, open } = known && line ? total(line, site, past ? null : modules) : { count: null };
    put(this.number, count === null ? "–" : String(count));
    put(this.words, headline(line, site, { count, open, past }));
    const alarms = new Map((alarmed ?? []).map(({ name, text }) => [name, text]));
    keyed(
      this.alarms,
      [...alarms.keys()],
      () => html("p", { className: "alarm" }),
      (alarm, name) => put(alarm, alarms.get(name)),
    );
    this.alarms.hidden = !alarms.size;
    this.showZones(site, line?.zones ?? {}, known);
    this.showEvents(events);
    this.showPassages(doors);
    this.showModules(site, modules, past);
    this.details.show(site, line, modules, chosen, names);
  }

  showZones(site, zones, known) {
    const all = site.zone ?? [];
    const counted = all.filter((zone) => zone.count);
    const names = (counted.length ? counted : all).map((zone) => zone.name);
    this.zoneTitle.hidden = !names.length;
    keyed(
      this.zones,
      names,
      (name) =>
        html(
          "article",
          { className: "card zone-card" },
          html("h3", {}, name),
          html("b", {}, "–"),
          html("p"),
          html("div", { className: "meter" }, html("i")),
        ),
      (card, name) => {
        const zone = known ? zones[name] : undefined;
        const unknown = !isCounted(zone);
        card.classList.toggle("unknown", unknown);
        const [, number, words, meter] = card.children;
        put(number, unknown ? "unknown" : String(zone.count));
        const sure = zone?.p?.[zone.count];
        put(
          words,
          !zone ? "no news" : seen(zone) +
            (!unknown && sure !== undefined && sure < 0.995 ? `, ${percent(sure)} sure` : ""),
        );
        meter.hidden = zone?.seen_share === undefined;
        meter.title = meter.hidden ? "" : `${percent(zone.seen_share)} of it seen now`;
        meter.firstChild.style.width = `${Math.round((zone?.seen_share ?? 0) * 100)}%`;
      },
    );
  }

  showEvents(events) {
    this.eventSection.hidden = !events.length;
    const key = (event) => `${event.at_ms} ${event.kind} ${event.subject} ${event.track}`;
    const byKey = new Map(events.map((event) => [key(event), event]));
    keyed(this.events, [...byKey.keys()], (name) => {
      const event = byKey.get(name), time = new Date(event.at_ms).toLocaleTimeString([], { hour12: false });
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
        time = new Date(begun_ms).toLocaleTimeString([], { hour12: false });
      const row = html(
        "a",
        {
          href: `#at=${begun_ms}`,
          title: "Show it on the map",
          onclick: () => this.on.seek(begun_ms),
        },
        html("time", {}, time),
        html(
          "span",
          {},
          `${passage.door}: ${passage.through.length} of ${passage.entered} went in: ${passage.reason}`,
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
      put(state, past && !line ? "" : !line ? "no news" : MODULE_WORDS[line.state] ?? line.state);
      put(alarm, line?.alarms[0]?.text ?? "");
      alarm.hidden = !alarm.textContent;
    });
  }

  /** Shows a form in the place of the figures, or the figures again. */
  edit(form) {
    this.form.hidden = !form;
    this.figures.hidden = Boolean(form);
    this.form.replaceChildren(...(form ? [form] : []));
  }
}
