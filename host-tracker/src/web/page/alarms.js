// The list of alarms: those that stand, since when and who has seen them, and those that ended within the last day.

import { Bell } from "./bell.js";
import { now } from "./clock.js";
import { ABOUT, SEVERITY } from "./names.js";
import { ask, send } from "./net.js";
import { html, put } from "./shapes.js";
import { alarmText, sayAbout } from "./alarm-words.js";
import { age, clockTime, parts, say, tell, word } from "./words.js";

const ENDED_SHOWN = 50;

const time = (ms) => html("time", { dateTime: new Date(ms).toISOString() }, clockTime(ms));

const seen = ({ acknowledged }) =>
  acknowledged &&
  html(
    "p",
    { className: "fine" },
    say("alarms.seen", { by: acknowledged.by, time: clockTime(acknowledged.at_ms) }),
  );

/** What nobody has seen comes first, then what takes away most, then the newest. */
const order = (a, b) =>
  Boolean(a.acknowledged) - Boolean(b.acknowledged) ||
  SEVERITY.indexOf(b.severity) - SEVERITY.indexOf(a.severity) || b.since_ms - a.since_ms;

export class Alarms {
  /** `on.choose` with {module} or {door} when its name is clicked. */
  constructor(on) {
    this.on = on;
    this.bell = new Bell();
    this.standing = [];
    this.known = false;
    this.list = html("ul", { id: "alarms-standing", className: "alarm-list" });
    this.words = html("p", { className: "fine" });
    this.error = html("p", { className: "error", role: "alert", hidden: true });
    this.said = html("div", { className: "for-screen-readers", role: "alert" });
    this.all = html("button", {
      type: "button",
      className: "button acknowledge",
      hidden: true,
      onclick: () => this.acknowledge(this.open().map(({ id }) => id)),
    }, say("alarms.all"));
    this.summary = html("summary", {}, "");
    this.ended = html("ul", { className: "alarm-list" });
    this.past = html("details", { id: "alarms-ended", hidden: true }, this.summary, this.ended);
    this.root = html(
      "section",
      { id: "alarms", "aria-label": say("alarms.title") },
      html("header", { className: "alarm-head" }, html("h2", {}, say("alarms.title")), this.bell.button),
      this.said,
      this.words,
      this.list,
      this.all,
      this.error,
      this.past,
    );
  }

  /** Those that nobody has seen. */
  open() {
    return this.standing.filter(({ acknowledged }) => !acknowledged);
  }

  /** Those that stand; null: that is not known. */
  update(standing) {
    this.known = standing !== null;
    const before = new Set(this.standing.map(({ id }) => id));
    if (standing) this.standing = [...standing].sort(order);
    const key = JSON.stringify(this.standing.map(({ id, acknowledged }) => [id, acknowledged]));
    if (standing && key !== this.key) {
      const begun = this.key === undefined ? [] : this.standing.filter(({ id }) => !before.has(id));
      if (begun.length) {
        this.said.textContent = begun.map((one) =>
          say("alarms.said", { about: sayAbout(one), text: alarmText(one) })
        )
          .join(" ");
      }
      this.key = key;
      this.bell.ring(this.open());
      this.loadEnded();
    }
    this.show();
  }

  show() {
    const text = this.known ? this.standing.length ? "" : say("alarms.none") : say("alarms.not-known");
    put(this.words, text);
    this.words.hidden = !text;
    this.list.classList.toggle("unknown", !this.known);
    this.all.hidden = !this.known || this.open().length < 2;
    const minute = Math.floor(now() / 10_000);
    const shown = JSON.stringify([minute, this.standing]);
    if (shown === this.shown) return;
    this.shown = shown;
    const old = new Map([...this.list.children].map((row) => [row.dataset.id, row]));
    const rows = this.standing.map((alarm) => {
      const row = old.get(String(alarm.id)) ??
        html("li", { className: "alarm-row", dataset: { id: alarm.id } });
      this.fill(row, alarm);
      return row;
    });
    // Only where the order is another: a row that moves loses the focus.
    if (
      rows.some((row, index) => this.list.children[index] !== row) ||
      rows.length !== this.list.children.length
    ) {
      this.list.replaceChildren(...rows);
    }
  }

  fill(row, alarm) {
    const shown = JSON.stringify([alarm.text, alarm.acknowledged]);
    if (row.dataset.parts !== shown) {
      row.dataset.parts = shown;
      row.dataset.severity = alarm.severity;
      row.dataset.seen = Boolean(alarm.acknowledged);
      const hadFocus = row.contains(document.activeElement);
      const why = html("button", {
        type: "button",
        className: "button why-alarm",
        "aria-label": say("alarms.why-of", { about: sayAbout(alarm), alarm: word("alarm", alarm.name) }),
        onclick: () => this.on.why({ alarm: alarm.name }),
      }, say("why.ask"));
      const button = alarm.acknowledged ? "" : html("button", {
        type: "button",
        className: "button acknowledge",
        "aria-label": say("alarms.acknowledge-of", {
          about: sayAbout(alarm),
          alarm: word("alarm", alarm.name),
        }),
        onclick: () => this.acknowledge([alarm.id]),
      }, say("alarms.acknowledge"));
      row.replaceChildren(
        ...this.head(alarm),
        html("p", { className: "since" }),
        seen(alarm) ?? "",
        button,
        why,
      );
      if (hadFocus) (row.querySelector(".acknowledge") ?? row.querySelector("button"))?.focus();
    }
    const since = (now() - alarm.since_ms) / 1000;
    const begun = { time: time(alarm.since_ms), age: age(since) };
    row.querySelector(".since").replaceChildren(
      ...parts(since >= 90 ? "alarms.since-age" : "alarms.since", begun),
    );
  }

  /** What it is about, how bad, and in words. */
  head(alarm) {
    const { source, of } = alarm;
    const chosen = source === ABOUT.MODULE ? { module: of } : source === ABOUT.DOOR ? { door: of } : null;
    const name = chosen
      ? html(
        "button",
        { type: "button", className: "alarm-of", onclick: () => this.on.choose(chosen) },
        sayAbout(alarm),
      )
      : html("strong", {}, sayAbout(alarm));
    return [
      html("i", { "aria-hidden": "true" }),
      name,
      html("em", {}, word("severity", alarm.severity)),
      html("p", {}, alarmText(alarm)),
    ];
  }

  async acknowledge(ids) {
    try {
      await send("POST", "/api/alarms/acknowledge", { ids });
      tell(this.error, null);
    } catch (error) {
      tell(this.error, error);
    }
  }

  async loadEnded() {
    const answer = await ask("/api/alarms").catch(() => null);
    if (!answer) return;
    const { ended } = answer;
    this.past.hidden = !ended.length;
    this.summary.textContent = ended.length > ENDED_SHOWN
      ? say("alarms.ended-last", { n: ended.length, most: ENDED_SHOWN })
      : say("alarms.ended", { n: ended.length });
    this.ended.replaceChildren(
      ...ended.slice(0, ENDED_SHOWN).map((alarm) =>
        html(
          "li",
          {
            className: "alarm-row over",
            dataset: { severity: alarm.severity, seen: Boolean(alarm.acknowledged) },
          },
          ...this.head(alarm),
          html(
            "p",
            { className: "since" },
            ...parts("alarms.until", { from: time(alarm.since_ms), until: time(alarm.until_ms) }),
          ),
          seen(alarm) ?? "",
        )
      ),
    );
  }
}
