// Guarded doors: on the map, as a list, and what is known of the chosen one, with the reset of its alarm.

import { now } from "./clock.js";
import { keepFocus } from "./focus.js";
import { HEALTH, LOCK } from "./names.js";
import { send, stamp } from "./net.js";
import { html, middle, path, svg } from "./shapes.js";
import { clockTime, say, tell, word } from "./words.js";

const PASSAGES = 8;

/** How a door is, in a word for the style sheet. */
function standing(line) {
  if (!line) return "unknown";
  if (line.alarm) return "alarm";
  if (line.trouble) return "trouble";
  return line.lock === LOCK.LOCKED ? "locked" : "open";
}

/** How a door is, in words. */
function words(line) {
  if (!line) return say("door.not-known");
  const more = line.alarm
    ? [say("door.alarm", { what: word("alarm", line.alarm) })]
    : line.trouble
    ? [word("trouble", line.trouble)]
    : [];
  const beneath = line.standing ? [say("door.alarm", { what: word("alarm", line.standing) })] : [];
  return [word("lock", line.lock), ...more, ...beneath].join(", ");
}

/** The doors in the list: all of the site while it is not known how they are, none of the past. */
export const doorsListed = (site, lines, past) =>
  past ? [] : (lines.length ? lines : site.door ?? []).map(({ name }) => name);

/** What the rows of the list show, as a text that differs when they do. */
export const listText = (names, byName) =>
  JSON.stringify(names.map((name) => {
    const line = byName.get(name);
    return [name, standing(line), words(line), line?.phase];
  }));

/** The doors on the map. */
export class DoorMarks {
  constructor(layer) {
    this.layer = layer;
  }

  /** Draws them; needed again when the site, the zoom or the choice changes. */
  site(site, px, chosen) {
    const marks = (site.door ?? []).map(({ name, line }) => {
      const [x, y] = middle(line);
      return svg(
        "g",
        { class: `door${chosen === name ? " chosen" : ""}`, "data-door": name, tabindex: 0, role: "button" },
        svg("path", { class: "leaf", d: path(line) }),
        svg(
          "g",
          { transform: `translate(${x} ${-y}) scale(${px})` },
          svg("circle", { class: "halo", r: 17 }),
          svg("circle", { class: "plate", r: 11 }),
          svg("path", { class: "shackle shut", d: "M-3 -1V-3.4a3 3 0 0 1 6 0V-1" }),
          svg("path", { class: "shackle open", d: "M-3 -1V-4.4a3 3 0 0 1 6 -.6" }),
          svg("rect", { class: "body", x: -4.5, y: -1, width: 9, height: 6.5, rx: 1.2 }),
        ),
        svg("text", { x, y: -y, dx: "1.4em", dy: "1.7em" }, name),
      );
    });
    keepFocus(this.layer, "door", () => this.layer.replaceChildren(...marks));
    this.states(this.lines ?? []);
  }

  states(lines) {
    this.lines = lines;
    const byName = new Map(lines.map((line) => [line.name, line]));
    for (const group of this.layer.children) {
      const line = byName.get(group.dataset.door), state = standing(line);
      if (group.dataset.state !== state) group.dataset.state = state;
      if (group.dataset.lock !== line?.lock) group.dataset.lock = line?.lock ?? "";
      const label = say("door.on-map", { name: group.dataset.door, how: words(line) });
      if (group.getAttribute("aria-label") !== label) group.setAttribute("aria-label", label);
    }
  }
}

/** The doors in the panel: a list, and the card of the chosen one. */
export class DoorPanel {
  /** `on.choose` with {door} or null, `on.seek` with a time. */
  constructor(on) {
    this.on = on;
    this.rows = html("ul", { className: "module-list", id: "doors" });
    this.list = html("section", { hidden: true }, html("h2", {}, say("doors.title")), this.rows);
    this.card = html("section", {
      className: "detail",
      id: "door-card",
      hidden: true,
      "aria-label": say("door.title"),
    });
    // Outside of what each change of the door draws anew: why a reset was refused is to be read.
    this.error = html("p", { className: "error", role: "alert", hidden: true });
    this.card.append(this.error);
  }

  /** `names`: of the list; `lines`: doors of a frame; `states`: with their passages. */
  show({ names, lines, states, chosen }) {
    this.list.hidden = !names.length;
    const byName = new Map(lines.map((line) => [line.name, line]));
    const text = listText(names, byName);
    if (this.rows.dataset.text !== text) {
      this.rows.dataset.text = text;
      const rows = names.map((name) => this.row(name, byName.get(name)));
      keepFocus(this.rows, "row", () => this.rows.replaceChildren(...rows));
    }
    const name = chosen?.door;
    this.card.hidden = !name;
    if (name !== this.name) tell(this.error, null);
    this.name = name;
    if (!name) return delete this.card.dataset.text;
    const line = lines.find((one) => one.name === name);
    const passages = states.find((one) => one.name === name)?.passages.slice(0, PASSAGES) ?? [];
    const shown = JSON.stringify([name, { ...line, names: [] }, passages]);
    if (this.card.dataset.text === shown) return;
    this.card.dataset.text = shown;
    this.fill(name, line, passages);
  }

  row(name, line) {
    const health =
      { alarm: HEALTH.BAD, trouble: HEALTH.BAD, open: HEALTH.WARN, locked: HEALTH.GOOD }[standing(line)];
    return html(
      "li",
      {},
      html(
        "button",
        {
          type: "button",
          className: "module-row",
          dataset: { health: health ?? HEALTH.NONE, row: name },
          onclick: () => this.on.choose({ door: name }),
        },
        html("i"),
        html("strong", {}, name),
        html("em", {}, line ? word("phase", line.phase) : words(line)),
        html("p", { hidden: !line?.alarm && !line?.trouble }, words(line)),
      ),
    );
  }

  fill(name, line, passages) {
    const focus = document.activeElement;
    const kept = this.card.contains(focus) ? focus.dataset.part : null;
    const close = html("button", {
      className: "close",
      type: "button",
      "aria-label": say("details.close"),
      dataset: { part: "close" },
      onclick: () => this.on.choose(null),
    }, "×");
    const rows = line ? about(line) : [[say("door.title"), say("door.not-known")]];
    const reset = html("button", {
      type: "button",
      className: "button main reset",
      hidden: !line?.alarm,
      dataset: { part: "reset" },
      onclick: () => this.reset(name),
    }, say("door.reset"));
    // Without an alarm there is nothing to be reset any more.
    if (!line?.alarm) tell(this.error, null);
    for (const old of [...this.card.childNodes]) if (old !== this.error) old.remove();
    this.error.before(
      html("header", {}, html("h2", {}, say("door.of", { name })), close),
      line?.alarm ? html("p", { className: "alarm" }, word("prompt", line.prompt_name)) : "",
      html("dl", {}, ...rows.flatMap(([term, value]) => [html("dt", {}, term), html("dd", {}, value)])),
      reset,
    );
    this.error.after(
      passages.length ? html("h3", {}, say("door.last")) : "",
      html("ul", { className: "events" }, ...passages.map((passed) => this.passage(passed))),
    );
    if (kept) this.card.querySelector(`[data-part="${kept}"]`)?.focus();
  }

  /** A passage; a link to its time. */
  passage({ begun_ms, passage }) {
    const row = html(
      "a",
      {
        href: `#at=${begun_ms}`,
        title: say("panel.show-map"),
        dataset: { kind: passage.alarm ? "alarm" : "passage" },
        onclick: () => this.on.seek(begun_ms),
      },
      html("time", { dateTime: new Date(begun_ms).toISOString() }, clockTime(begun_ms)),
      html("span", {}, passed(passage)),
    );
    return html("li", {}, row);
  }

  /** Somebody has looked after the alarm. */
  async reset(name) {
    const at_ms = Math.round(now());
    let why = null;
    try {
      await send("POST", `/api/door/${encodeURIComponent(name)}/reset`, stamp(at_ms));
    } catch (error) {
      why = error;
    }
    // Another door may have been chosen meanwhile.
    if (name === this.name) tell(this.error, why);
  }
}

function about(line) {
  const lock = word("lock", line.lock);
  const rows = [
    [say("door.lock"), line.lock_taken ? lock : say("door.unconfirmed", { lock })],
    [say("details.doing"), word("phase", line.phase)],
    [say("door.leaf"), line.contact ? word("contact", line.contact) : say("door.not-known")],
  ];
  if (line.trouble) rows.push([say("door.trouble"), word("trouble", line.trouble)]);
  if (line.entered) {
    rows.push([say("door.went-in"), say("door.of-entered", { n: line.through, of: line.entered })]);
  }
  rows.push([say("door.screen-says"), word("prompt", line.prompt_name)]);
  return rows;
}

/** How a passage ended. */
export const passed = ({ through, entered, outcome, alarm }) =>
  say("door.passage", {
    n: through.length,
    of: entered,
    how: alarm ? word("alarm", alarm) : word("outcome", outcome),
  });
