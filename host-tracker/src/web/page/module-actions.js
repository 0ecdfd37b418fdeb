// What can be done with the chosen module: learn, absorb a thing, restart, rename, settings.

import { askModule } from "./net.js";
import { html, isPlaced, svg } from "./shapes.js";
import { changeSite } from "./site-file.js";
import { mayChangeSite } from "./who.js";
import { age, degrees, metres, say, tell, word } from "./words.js";

/** Settings by which a module can be lost. */
const LOSES = new Set(["address", "hosts"]);

export class ModuleActions {
  /** `on.mark` is a layer of the map, for the things that a module sees; `on.choose` is called with {module} when it has another
   * name. */
  constructor(on) {
    this.on = on;
    this.mark = on.mark;
    this.name = null;
    this.said = html("p", { className: "fine", role: "status" });
    this.error = html("p", { className: "error", role: "alert", hidden: true });
    this.more = html("div", { className: "module-more" });
    const button = (what, onclick) =>
      html(
        "button",
        { type: "button", className: "button", title: say(`look.${what}-title`), onclick },
        say(`look.${what}`),
      );
    this.buttons = html(
      "div",
      { className: "row" },
      button("blink", () => this.blink()),
      button("learn", () => this.confirmLearn()),
      button("absorb", () => this.things()),
      this.furniture = button("furniture", () => this.confirmFurniture()),
      button("rename", () => this.rename()),
      button("settings", () => this.settings()),
      button("restart", () => this.confirmRestart()),
    );
    this.root = html(
      "section",
      { className: "module-actions", hidden: true, "aria-label": say("look.label") },
      html("h3", {}, say("look.title")),
      this.buttons,
      this.more,
      this.said,
      this.error,
    );
  }

  /** Another module is chosen, or none; `pose` is its place in the site, `line` what is known of it. */
  choose(name, pose, line) {
    this.pose = pose;
    this.root.hidden = !name || !line;
    this.suspects = line?.suspects ?? [];
    // Only where the site can keep the answer.
    this.furniture.hidden = !pose || !this.suspects.length || !mayChangeSite();
    if (name === this.name) return;
    this.name = name;
    this.clear();
    this.say("");
  }

  clear(...parts) {
    this.mark.replaceChildren();
    this.more.replaceChildren(...parts);
    this.more.querySelector("input, button")?.focus();
  }

  say(text, error = null) {
    this.said.textContent = text;
    tell(this.error, error);
  }

  /** Asks for something; the answer, or null: then it has said why not. */
  async ask(action, body) {
    const { name } = this;
    this.busy(true);
    this.say(say("look.asking"));
    try {
      const answer = await askModule(name, action, body);
      if (name !== this.name) return null;
      this.say("");
      return answer;
    } catch (error) {
      if (name === this.name) this.say("", error);
      return null;
    } finally {
      this.busy(false);
    }
  }

  busy(is) {
    for (const button of this.root.querySelectorAll("button")) {
      button.disabled = is || button.dataset.off === "true";
    }
  }

  /** A question before something that cannot be taken back at once; `no`: what is shown again, if anything. */
  confirm(question, words, yes, ...no) {
    this.say("");
    const back = html(
      "button",
      { type: "button", className: "button", onclick: () => this.clear(...no) },
      say("look.cancel"),
    );
    this.clear(
      html("p", {}, question),
      html(
        "div",
        { className: "row" },
        html("button", {
          type: "button",
          className: "button main",
          onclick: yes,
        }, words),
        back,
      ),
    );
  }

  confirmLearn() {
    this.confirm(
      say("look.learn-ask"),
      say("look.learn-yes"),
      async () => {
        if (await this.ask("learn", {})) {
          this.clear();
          this.say(say("look.learning"));
        }
      },
    );
  }

  confirmRestart() {
    this.confirm(
      say("look.restart-ask"),
      say("look.restart-yes"),
      async () => {
        if (await this.ask("restart", {})) {
          this.clear();
          this.say(say("look.restarting"));
        }
      },
    );
  }

  /** Shapes of people in what it has learned, each shown on the map: are they furniture? */
  confirmFurniture() {
    const { name, suspects } = this;
    const places = suspects.map(([bearing_deg, range_m], index) =>
      html(
        "li",
        {},
        say("look.furniture-place", { n: index + 1, range: metres(range_m), bearing: degrees(bearing_deg) }),
      )
    );
    this.confirm(say("look.furniture-ask"), say("look.furniture-yes"), async () => {
      this.busy(true);
      try {
        await changeSite((site) => {
          const module = site.module.find((module) => module.name === name);
          if (module) module.furniture = [...module.furniture ?? [], ...suspects];
        });
        this.clear();
        this.say(say("look.furniture-known"));
      } catch (error) {
        this.say("", error);
      } finally {
        this.busy(false);
      }
    });
    this.more.firstChild.after(html("ul", { className: "things" }, ...places));
    this.mark.replaceChildren(
      ...suspects.map(([bearing_deg, range_m], index) => this.thing({ bearing_deg, range_m }, index)),
    );
  }

  async blink() {
    if (await this.ask("identify", {})) {
      this.say(say("look.blinks"));
    }
  }

  rename() {
    this.say("");
    const name = html("input", { id: "module-name", value: this.name, maxLength: 32, required: true });
    const form = html(
      "form",
      { className: "form" },
      html("label", { for: "module-name" }, say("look.name"), name),
      html(
        "div",
        { className: "row" },
        html("button", { className: "button main" }, say("look.rename-yes")),
        this.cancel(),
      ),
    );
    form.onsubmit = async (event) => {
      event.preventDefault();
      const to = name.value.trim();
      if (await this.ask("rename", { name: to })) {
        this.on.choose({ module: to });
        this.say(say("look.renamed", { name: to }));
      }
    };
    this.clear(form);
    name.select();
  }

  cancel() {
    return html(
      "button",
      { type: "button", className: "button", onclick: () => this.clear() },
      say("look.cancel"),
    );
  }

  async settings() {
    const answer = await this.ask("");
    if (!answer) return;
    const { name: _, ...settings } = answer.settings;
    const fields = Object.entries(settings).map(([key, value]) => {
      const input = html("input", { id: `setting-${key}`, value, autocomplete: "off", spellcheck: false });
      input.dataset.key = key;
      return html("label", { for: input.id, title: key }, word("setting", key), input);
    });
    const form = html(
      "form",
      { className: "form" },
      ...fields,
      html("p", { className: "fine" }, say("look.settings-warning")),
      html(
        "div",
        { className: "row" },
        html("button", { className: "button main" }, say("look.store")),
        this.cancel(),
      ),
    );
    form.onsubmit = (event) => {
      event.preventDefault();
      const changed = Object.fromEntries(
        [...form.querySelectorAll("input")].filter(({ dataset, value }) => value !== settings[dataset.key])
          .map(({ dataset, value }) => [dataset.key, value.trim()]),
      );
      const keys = Object.keys(changed);
      if (!keys.length) return this.say(say("look.unchanged"));
      const store = async () => {
        if (await this.ask("settings", changed)) {
          this.clear();
          this.say(say("look.stored", { keys: keys.map((key) => word("setting", key)).join(", ") }));
        }
      };
      if (!keys.some((key) => LOSES.has(key))) return store();
      this.confirm(
        say("look.settings-ask"),
        say("look.store"),
        store,
        // With all that was typed.
        form,
      );
    };
    this.clear(form);
  }

  async things() {
    const things = await this.ask("things");
    if (!things) return;
    if (!things.length) return this.clear(html("p", {}, say("look.nothing")));
    const rows = things.map((thing, index) => {
      const { bearing_deg, range_m, still_s, is_still } = thing;
      const facts = {
        n: index + 1,
        range: metres(range_m),
        bearing: degrees(bearing_deg),
        age: age(still_s),
      };
      const text = say(is_still ? "look.thing-still" : "look.thing-moves", facts);
      return html(
        "li",
        {},
        html("span", {}, text),
        html("button", {
          type: "button",
          className: "button",
          disabled: !is_still,
          dataset: { off: !is_still },
          title: is_still ? "" : say("look.absorb-still"),
          "aria-label": say("look.absorb-of", { thing: text }),
          onclick: () => this.absorb(bearing_deg),
        }, say("look.absorb-yes")),
      );
    });
    this.clear(
      html("p", {}, say("look.absorb-warning")),
      html("ul", { className: "things" }, ...rows),
      html("div", { className: "row" }, this.cancel()),
    );
    this.mark.replaceChildren(...things.map((thing, index) => this.thing(thing, index)));
  }

  /** Where a thing is on the map. */
  thing({ bearing_deg, range_m }, index) {
    if (!this.pose || !isPlaced(this.pose)) return "";
    const side = this.pose.upside_down ? -1 : 1;
    const rad = (this.pose.yaw_deg + side * bearing_deg) * Math.PI / 180;
    const x = this.pose.x + Math.cos(rad) * range_m, y = this.pose.y + Math.sin(rad) * range_m;
    return svg(
      "g",
      { class: "thing", transform: `translate(${x} ${-y})` },
      svg("circle", { r: 0.18 }),
      svg("text", { "text-anchor": "middle", dy: ".35em" }, String(index + 1)),
    );
  }

  async absorb(bearing) {
    const answer = await this.ask("absorb", { bearing });
    if (!answer) return;
    this.clear();
    this.say(say("look.absorbed", { range: metres(answer.range_m), n: answer.beams }));
  }
}
