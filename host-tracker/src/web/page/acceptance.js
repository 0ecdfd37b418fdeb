// The acceptance form of the handover page: what the tracker knows is filled in, the rest is for the pen.

import { MODULE } from "./names.js";
import { table } from "./paper.js";
import { html, isMeasured } from "./shapes.js";
import { percent, say } from "./words.js";

const LOST_MOST = 0.01;

const worst = (list, of) =>
  list.reduce((most, one) => most === null || of(one) > of(most) ? one : most, null);

/** What the tracker knows by itself: how many modules work, the worst loss, the zone that is seen least. */
export function known(site, frame, found) {
  const lines = new Map((frame.modules ?? []).map((line) => [line.name, line]));
  const modules = site.module ?? [];
  const heard = modules.map(({ name }) => lines.get(name)).filter((line) => line !== undefined);
  const lost = worst(heard.filter((line) => isMeasured(line, "lost_share")), ({ lost_share }) => lost_share);
  const least = worst(found.zones, ({ one }) => -one);
  const work = heard.filter(({ state, alarms }) => state === MODULE.WATCHING && !alarms.length).length;
  return {
    modules: say("accept.modules-found", { work, all: modules.length }),
    lost: lost
      ? say("accept.lost-found", { share: percent(lost.lost_share, 1), name: lost.name })
      : say("accept.lost-none"),
    seen: least
      ? say("accept.seen-found", { share: percent(least.one), name: least.zone })
      : say("accept.seen-none"),
  };
}

export function acceptance(site, frame, found) {
  const { modules, lost, seen } = known(site, frame, found);
  const rows = [
    [say("accept.modules"), say("accept.modules-right"), modules],
    [say("accept.lost"), say("accept.lost-right", { share: percent(LOST_MOST) }), lost],
    [say("accept.seen"), say("accept.seen-right"), seen],
    [say("accept.empty"), say("accept.empty-right")],
    [say("accept.walk"), say("accept.walk-right")],
    [say("accept.dark"), say("accept.dark-right")],
    [say("accept.crowd"), say("accept.crowd-right")],
    [say("accept.unplug"), say("accept.unplug-right")],
    [say("accept.power"), say("accept.power-right")],
    [say("accept.uses"), say("accept.uses-right")],
    [say("accept.photo"), say("accept.photo-right")],
  ];
  const line = (label) => html("p", { className: "sign" }, label);
  return html(
    "section",
    { id: "acceptance" },
    html("h2", {}, say("accept.title")),
    table(
      [say("accept.what"), say("accept.right"), say("accept.found"), say("accept.ok")],
      rows.map(([what, right, here = ""]) => [what, [right, "words"], [here, "words"], ["", "tick"]]),
    ),
    line(say("accept.blind")),
    line(say("accept.open")),
    html(
      "div",
      { className: "signatures" },
      line(say("accept.date")),
      line(say("accept.installer")),
      line(say("accept.customer")),
    ),
  );
}
