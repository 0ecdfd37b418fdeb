// The calibration view: tells the visitor where to walk, pair by pair; the result is shown on the map and accepted with a click.

import { WISH } from "./names.js";
import { ask, send } from "./net.js";
import { html, svg } from "./shapes.js";
import { centimetres, degrees, list, metres, number, percent, say, squareMetres, tell } from "./words.js";

const LOOK_MS = 500;
const SHADES = ["#3b82f633", "#3b82f666", "#3b82f699"]; // seen by one, two, more
const AREAS = 4; // the largest, in words; all are on the map
const shade = (modules) => SHADES[Math.min(modules.length, SHADES.length) - 1];

/** What the walker is to do, or how good the result is, or why there is none. */
function advised({ advice_is, refused_is, found }) {
  if (refused_is) return refused(refused_is);
  if (found) return quality(found.quality_is);
  const { is, place, ...names } = advice_is;
  return place ? say(`advice.${is}-${place.side}`, { ...names, n: place.steps }) : say(`advice.${is}`, names);
}

const refused = ({ is, ...facts }) =>
  say(`refused.${is}`, {
    ...facts,
    s: number(facts.common_s ?? 0),
    needed: number(facts.needed_s ?? 0),
    spread: metres(facts.spread_m ?? 0, 1),
    share: percent(facts.share ?? 0),
    within: centimetres(facts.within_m ?? 0),
    angle: degrees(facts.within_deg ?? 0),
  });

function quality(by) {
  if (!by) return say("quality.single");
  return say(by.wall_m === null ? "quality.no-walls" : "quality.walls", {
    grade: say(`grade.${by.grade}`),
    apart: centimetres(by.apart_m),
    wall: metres(by.wall_m ?? 0, 0),
    within: centimetres(by.within_m),
  });
}

/** Which way up a module hangs, and how clearly the walk says so, behind its place. */
function hung({ hang, upside_down, ...module }, first) {
  if (!hang) return placed(module);
  const facts = { placed: placed(module), way: upside_down ? say("hang.down") : say("hang.upright") };
  if (hang.right_m == null) return say("hang.unsaid", facts);
  Object.assign(facts, { first, right: centimetres(hang.right_m), wrong: centimetres(hang.wrong_m) });
  return hang.turned ? say("hang.turned", facts) : say("hang.as-before", facts);
}

/** Where a module or a floor is, and how well that is known. */
function placed({ name, x, y, yaw_deg, within_m, within_deg, clock_within_ms }) {
  const kind = within_m === 0 ? "fixed" : clock_within_ms === undefined ? "floor" : "module";
  return say(`placed.${kind}`, {
    name,
    x: metres(x),
    y: metres(y),
    yaw: degrees(yaw_deg, 1),
    within: centimetres(within_m),
    angle: degrees(within_deg, 1),
    ms: number(clock_within_ms ?? 0),
  });
}

export class Calibration {
  /** `on.form` with an element for the panel or null, `on.close(saved, said)` when it is over, with what is to be said, if anything,
   * `on.failed` with why the tracker may not have stopped. */
  constructor(layer, on) {
    Object.assign(this, { layer, on, open: false, text: "" });
    this.advice = html("p", { className: "walk-advice", id: "calibrate-advice", role: "status" });
    this.sees = html("p", { className: "walk-sees" });
    this.bar = html("div", { className: "meter" }, html("i"));
    this.pairs = html("ul", { className: "walk-pairs", id: "calibrate-pairs" });
    this.result = html("div", { id: "calibrate-result" });
    const button = (id, text, onclick) =>
      html("button", { id, type: "button", className: "button", onclick }, text);
    this.finish = button("calibrate-finish", say("walk.finish"), () => this.wish(WISH.FINISH));
    this.again = button("calibrate-again", say("walk.again"), () => this.wish(WISH.GO_ON));
    this.accept = button("calibrate-accept", say("walk.accept"), () => this.wish(WISH.ACCEPT));
    this.stop = button("calibrate-stop", say("walk.stop"), () => this.leave());
    this.form = html(
      "section",
      { className: "detail walk", id: "calibrate" },
      html("header", {}, html("h2", {}, say("walk.title"))),
      this.advice,
      this.sees,
      this.bar,
      // Above all that grows with the number of modules.
      html("div", { className: "walk-buttons" }, this.finish, this.again, this.accept, this.stop),
      this.result,
      this.pairs,
    );
    this.form.setAttribute("aria-label", say("walk.label"));
  }

  start() {
    Object.assign(this, { open: true, begun: false, text: "" });
    // What the walk before has found is not this one's to accept.
    this.advice.textContent = this.sees.textContent = "";
    this.result.replaceChildren();
    this.pairs.replaceChildren();
    this.finish.hidden = false;
    this.again.hidden = this.accept.hidden = true;
    this.on.form(this.form);
    this.timer = setInterval(() => this.look(), LOOK_MS);
    this.wish(WISH.BEGIN);
  }

  wish(what) {
    const asked = () => send("POST", "/api/calibration", { do: what });
    // The tracker may not have heard yet that the walk before was left.
    return this.asks(this.leaving ? this.leaving.then(asked) : asked(), what === WISH.ACCEPT);
  }

  look() {
    return this.asks(ask("/api/calibration"), false);
  }

  /** Shows an answer; `ends`: with it the walk is over. One that comes after this view was left says nothing of the next. */
  async asks(asked, ends) {
    const { begun, timer } = this;
    try {
      const answer = await asked;
      if (timer !== this.timer) return;
      if (ends) this.close(true);
      else this.show(answer, begun);
    } catch (error) {
      if (timer === this.timer) this.fail(error);
    }
  }

  /** Leaves the view at once, also while the tracker is silent: nothing of a walk is kept before it is accepted. */
  leave() {
    this.close(false);
    const leaving = send("POST", "/api/calibration", { do: WISH.STOP })
      .catch((error) => this.on.failed(error))
      .finally(() => {
        if (this.leaving === leaving) this.leaving = null;
      });
    this.leaving = leaving;
    return leaving;
  }

  /** The error takes the place of the advice until the next status, the same one, too. */
  fail(error) {
    tell(this.advice, error);
    this.text = "";
  }

  close(saved, said = "") {
    // It has ended elsewhere before the answer came: the map and the panel are another's.
    if (!this.open) return;
    clearInterval(this.timer);
    Object.assign(this, { open: false, timer: 0 });
    this.layer.replaceChildren();
    this.on.form(null);
    this.on.close(saved, said);
  }

  /** `begun`: whether the tracker had begun before it was asked; a walk that is none after that has ended elsewhere. */
  show(status, begun) {
    if (!this.open) return;
    if (!status.active) return begun ? this.close(false, say("walk.ended")) : undefined;
    this.begun = true;
    // The tracker has begun, and has no advice yet.
    if (!status.advice_is && !status.found && !status.refused_is) return;
    const done = Boolean(status.found || status.refused);
    const text = JSON.stringify(status);
    if (text === this.text) return;
    this.text = text;
    tell(this.advice, { message: advised(status) });
    this.advice.classList.toggle("alarm", Boolean(status.refused));
    this.form.dataset.state = status.found
      ? "found"
      : status.refused
      ? "refused"
      : status.enough
      ? "enough"
      : "walking";
    const crowd = status.crowded_s > 0.5 ? say("walk.crowded", { s: number(status.crowded_s) }) : "";
    this.sees.textContent = done
      ? ""
      : (status.sees.length ? say("walk.sees", { modules: list(status.sees) }) : say("walk.unseen")) + crowd;
    this.bar.hidden = done;
    this.bar.firstChild.style.width = `${Math.round(status.progress * 100)}%`;
    this.pairs.replaceChildren(...status.pairs.map(({ modules, common_s, needed_s, residual_m }) => {
      const share = Math.min(common_s / needed_s, 1);
      const words = residual_m != null
        ? say("walk.apart", { apart: centimetres(residual_m) })
        : say("walk.common", { s: number(Math.min(common_s, needed_s)), of: needed_s });
      return html(
        "li",
        { className: share >= 1 ? "done" : "" },
        html("strong", {}, modules.join(" + ")),
        html("em", {}, words),
        html("div", { className: "meter" }, html("i", { style: `width:${Math.round(share * 100)}%` })),
      );
    }));
    this.result.replaceChildren(
      ...(status.found?.modules ?? []).map((module, _, [{ name }]) => html("p", {}, hung(module, name))),
    );
    if (status.found) {
      const { seen_m2: [one, two], areas } = status.found.coverage;
      this.result.append(
        html("p", {}, say("walk.coverage", { one: squareMetres(one, 0), two: squareMetres(two, 0) })),
        html(
          "ul",
          { className: "walk-areas" },
          ...areas.slice(0, AREAS).map(({ modules, m2 }) =>
            html(
              "li",
              {},
              html("i", { style: `background:${shade(modules)}` }),
              say("walk.area", { modules: modules.join(" + "), area: squareMetres(m2) }),
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
        title.textContent = say("walk.seen-by", { modules: list(modules) });
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
