// The map: floor, fields of view, walls, zones, entries, lines, movers, modules, and people with their trails.

import { keepFocus } from "./focus.js";
import { modulePx, NAMES_PX, ofEntry, ofModule, ofZones, small } from "./labels.js";
import { drawCounts, drawLines } from "./lines.js";
import { BLOCKS, TRACK } from "./names.js";
import { Motion } from "./motion.js";
import { box, health, isCounted, isPlaced, path, put, stripes, svg } from "./shapes.js";
import { say } from "./words.js";

const TRAIL_MS = 12_000;
const FADES = [0.2, 0.4, 0.65, 0.9];
const SIGMAS = 2;
const BODY_M = 0.2;
const HUES = 8;
/** How large the visitor wants text, in pixels. */
const rem = () => parseFloat(getComputedStyle(document.documentElement).fontSize);

/** Writes a zone's name and count, or the count alone where both are wider than the zone has room for. */
function label(element, name, count) {
  const full = count === undefined ? name : `${name} · ${count}`;
  if (element.dataset.label === full) return;
  element.dataset.label = element.textContent = full;
  if (element.getBBox().width > Number(element.dataset.room)) element.textContent = count ?? "?";
}

/** Panels from one column and row to another, those excluded, as a path. */
function area({ x, y, yaw_deg, pitch_m }, [column, row], [toColumn, toRow]) {
  const rad = (yaw_deg * Math.PI) / 180, along = [Math.cos(rad) * pitch_m, Math.sin(rad) * pitch_m];
  const at = (columns, rows) => [
    x + along[0] * columns - along[1] * rows,
    y + along[1] * columns + along[0] * rows,
  ];
  return path([at(column, row), at(toColumn, row), at(toColumn, toRow), at(column, toRow)], true);
}

export class Drawing {
  constructor(root) {
    this.root = root;
    this.people = new Map();
    this.motion = new Motion();
    this.layers = {};
    this.waiting = new Set();
    const dot = svg("circle", { class: "dots", cx: 0.5, cy: 0.5, r: 0.025 });
    const grid = svg("pattern", { id: "grid", width: 1, height: 1, patternUnits: "userSpaceOnUse" }, dot);
    root.append(
      svg("defs", {}, grid, stripes("hatch", "hatch", 0.12, 0.03)),
      svg("rect", { x: -5000, y: -5000, width: 10000, height: 10000, fill: "url(#grid)" }),
    );
    for (
      const name of [
        "fields",
        "rims",
        "picture",
        "zones",
        "heat",
        "unseen",
        "panels",
        "movers",
        "excludes",
        "trails",
        "walls",
        "entries",
        "lines",
        "doors",
        "modules",
        "labels",
        "people",
        "names",
        "things",
        "walk",
        "survey",
        "edit",
      ]
    ) {
      root.append(this.layers[name] = svg("g", { class: name === "rims" ? "fields chosen" : name }));
    }
  }

  /** Draws the site; needed again when the site or the zoom changes. */
  site(site, px, chosen) {
    const { zones, movers, excludes, walls, entries, modules } = this.layers;
    const counted = (site.zone ?? []).some((zone) => zone.count);
    zones.replaceChildren(
      ...(site.zone ?? []).map((zone) =>
        svg("path", {
          class: "zone",
          d: path(zone.polygon, true),
          "data-zone": zone.name,
          style: counted && !zone.count ? "fill-opacity:0;stroke-opacity:.25" : null,
        })
      ),
    );
    movers.replaceChildren(
      ...(site.mover ?? []).map((mover) => svg("path", { class: "mover", d: path(mover.polygon, true) })),
    );
    excludes.replaceChildren(
      ...(site.exclude ?? []).flatMap(({ name = "", polygon }) => {
        const [left, low, right, high] = box(polygon);
        return [
          svg(
            "path",
            { class: "exclude", d: path(polygon, true) },
            svg("title", {}, say("map.nobody-counted", { name })),
          ),
          svg("text", {
            class: "entry-name",
            x: (left + right) / 2,
            y: -(low + high) / 2,
            "text-anchor": "middle",
          }, say("map.not-counted")),
        ];
      }),
    );
    walls.replaceChildren(...(site.wall ?? []).map((wall) =>
      svg("path", {
        class: `wall${wall.blocks.includes(BLOCKS.BEAMS) ? "" : " glass"}${wall.mirror ? " mirror" : ""}`,
        d: path(wall.points),
      })
    ));
    entries.replaceChildren(
      ...(site.entry ?? []).map((entry) => svg("path", { class: "entry", d: path(entry.line) })),
    );
    drawLines(this.layers.lines, site, px);
    // One that is not placed waits in the tray, and what it sees is in its own frame.
    const placed = (site.module ?? []).filter(isPlaced);
    const waiting = (site.module ?? []).filter((module) => !isPlaced(module));
    this.waiting = new Set(waiting.map(({ name }) => name));
    const marks = placed.map((module) => this.module(module, px, chosen));
    keepFocus(modules, "module", () => modules.replaceChildren(...marks));
    this.names(site, px, (site.zone ?? []).filter((zone) => zone.count || !counted));
  }

  /** Writes the names of zones and entries over the people, who pass beneath them; a click there is for the person, and where
   * nobody is for the name, which stands unseen below them, too. */
  names(site, px, zones) {
    const places = ofZones(zones, site, px, rem()), size = small(px, rem());
    const texts = (more) =>
      zones.map(({ name }, index) => {
        const { x, y, anchor, room } = places[index];
        const where = { x, y: -y, "text-anchor": anchor, "data-zone": name, "data-room": room };
        return svg("text", { class: "zone-name", ...where, ...more }, name);
      });
    this.layers.labels.replaceChildren(...texts());
    this.layers.names.replaceChildren(
      ...(site.entry ?? []).map((entry) => {
        const { x, y, anchor } = ofEntry(entry, size);
        return svg("text", { class: "entry-name", x, y: -y, "text-anchor": anchor }, entry.name);
      }),
      // Read aloud once: they are the same as those below.
      ...texts({ "aria-hidden": true }),
    );
  }

  module(module, px, chosen) {
    const r = modulePx(px) * px;
    const cone = [-32, 32].map((deg) => (deg * Math.PI) / 180).map((
      rad,
    ) => [Math.cos(rad) * 3.4 * r, -Math.sin(rad) * 3.4 * r]);
    return svg(
      "g",
      {
        class: `module${chosen === module.name ? " chosen" : ""}`,
        "data-module": module.name,
        tabindex: 0,
        role: "button",
        "aria-label": say("map.module", { name: module.name }),
        transform: `translate(${module.x} ${-module.y})`,
      },
      svg("circle", { class: "halo", r: 3 * r }),
      svg("path", {
        class: "cone",
        transform: `rotate(${-module.yaw_deg})`,
        d: `M0 0L${cone[0]}A${3.4 * r} ${3.4 * r} 0 0 0 ${cone[1]}Z`,
      }),
      svg("circle", { class: "box", r }),
      this.moduleName(module, px, chosen),
    );
  }

  /** The name stands where the module looks; a small map has room for that of the chosen one only. */
  moduleName(module, px, chosen) {
    const { name } = module;
    if (px > NAMES_PX && chosen !== name) return "";
    const { x, y, anchor } = ofModule(module, px, small(px, rem()));
    return svg("text", { class: "module-name", x, y: -y, "text-anchor": anchor }, name);
  }

  /** Draws what was seen within the last two seconds; the field of the chosen module stands out. */
  fields(recent, chosen) {
    const all = recent.flatMap((fields) => Object.entries(fields)).filter(([name, corners]) =>
      corners.length > 2 && !this.waiting.has(name)
    );
    const one = ([name, corners]) => svg("path", { d: path(corners, true), "data-field": name });
    this.layers.fields.replaceChildren(...all.map(one));
    this.layers.rims.replaceChildren(...all.filter(([name]) => name === chosen).map(one));
  }

  /** Draws the panels of floors that are down, and those that do not work; `lines`: the floors of a frame. */
  panels(site, lines) {
    const byName = new Map((site?.floor ?? []).map((floor) => [floor.name, floor]));
    const shapes = [...byName.values()].flatMap((floor) => [
      svg("path", {
        class: "floor",
        d: area(floor, [0, 0], [floor.columns, floor.rows]),
        "data-floor": floor.name,
      }),
      svg("text", { class: "module-name", x: floor.x, y: -floor.y, dx: ".4em", dy: "-.5em" }, floor.name),
    ]);
    for (const { name, columns, down, stuck = [], dead = [], unknown_from = null } of lines) {
      const floor = byName.get(name);
      if (!floor) continue;
      const panel = (kind) => (number) => {
        const [column, row] = [number % columns, Math.floor(number / columns)];
        return svg("path", { class: `panel ${kind}`, d: area(floor, [column, row], [column + 1, row + 1]) });
      };
      const unknown = unknown_from === null ? 0 : columns * floor.rows - unknown_from;
      const behind = Array.from({ length: Math.max(0, unknown) }, (_, index) => unknown_from + index);
      shapes.push(...down.map(panel("down")), ...[...stuck, ...dead, ...behind].map(panel("faulty")));
    }
    this.layers.panels.replaceChildren(...shapes);
  }

  /** Updates the health of modules and the counts of zones. */
  states(lines, zones) {
    const byName = new Map(lines.map((line) => [line.name, line]));
    for (const group of this.layers.modules.children) {
      const state = health(byName.get(group.dataset.module));
      if (group.dataset.health !== state) group.dataset.health = state;
    }
    const { zones: areas, labels, names } = this.layers;
    for (const element of [areas, labels, names].flatMap(({ children }) => [...children])) {
      const zone = zones[element.dataset.zone];
      if (!element.dataset.zone) continue;
      element.classList.toggle("unknown", !isCounted(zone));
      if (element.tagName !== "text") continue;
      const count = isCounted(zone) ? String(zone.count) : "?";
      label(element, element.dataset.zone, count);
    }
  }

  /** Writes how often each line was crossed. */
  crossed(lines) {
    drawCounts(this.layers.lines, lines);
  }

  /** Draws tracks, their trails and covariances; `names`: the ID that each track may have, in words; `ms`: the time of them on a
   * clock that goes on, by which they walk, or null. */
  tracks(tracks, past, chosen, names, ms) {
    const there = new Set(), places = [];
    for (const track of tracks) {
      there.add(track.id);
      let person = this.people.get(track.id);
      if (!person) this.people.set(track.id, person = this.person(track.id));
      places.push([track.id, person.group, track.x, track.y]);
      const shown = `person ${track.state}${chosen === track.id ? " chosen" : ""}`;
      if (person.group.getAttribute("class") !== shown) person.group.setAttribute("class", shown);
      const occluded = track.state === TRACK.OCCLUDED, word = occluded ? say("map.hidden") : "";
      const label = [chosen === track.id ? track.id : "", names.get(track.id) ?? "", word].filter(Boolean)
        .join(" · ");
      put(person.text, label);
      person.group.setAttribute(
        "aria-label",
        say(occluded ? "map.person-occluded" : "map.person-n", { id: String(track.id) }),
      );
      this.ellipse(person.ellipse, track.cov);
      const speed = Math.hypot(track.vx, track.vy);
      const reach = speed > 0.25 && track.state === TRACK.CONFIRMED
        ? (BODY_M + 0.12 + Math.min(speed, 2) * 0.08) / speed
        : 0;
      person.nose.setAttribute("x2", track.vx * reach);
      person.nose.setAttribute("y2", -track.vy * reach);
    }
    for (const [id, { group }] of this.people) {
      if (!there.has(id)) {
        group.remove();
        this.people.delete(id);
      }
    }
    this.motion.show(ms, places);
    this.trails(tracks, past);
  }

  person(id) {
    const [ellipse, ring, nose, body, text] = [
      svg("ellipse", { class: "ellipse" }),
      svg("circle", { class: "ring", r: BODY_M * 1.7 }),
      svg("line", { class: "nose" }),
      svg("circle", { class: "body", r: BODY_M }),
      svg("text", { "text-anchor": "middle", dy: "-1.9em" }),
    ];
    const group = svg(
      "g",
      { "data-person": id, tabindex: 0, role: "button", style: `--c:var(--p${id % HUES})` },
      ellipse,
      ring,
      nose,
      body,
      text,
    );
    this.layers.people.append(group);
    return { group, ellipse, nose, text };
  }

  ellipse(element, cov) {
    if (!cov) return element.setAttribute("rx", 0);
    const [xx, xy, yy] = cov;
    const middle = (xx + yy) / 2, off = Math.hypot((xx - yy) / 2, xy);
    const radius = (variance) => Math.min(SIGMAS * Math.sqrt(Math.max(variance, 0)), 4);
    element.setAttribute("rx", radius(middle + off));
    element.setAttribute("ry", radius(middle - off));
    element.setAttribute("transform", `rotate(${(-Math.atan2(2 * xy, xx - yy) / 2) * (180 / Math.PI)})`);
  }

  /** `past`: frames or lines of history, oldest first, up to what is shown. */
  trails(tracks, past) {
    const until = past.at(-1)?.unix_ms ?? 0;
    const ways = new Map(tracks.map((track) => [track.id, []]));
    for (const line of past) {
      if (line.unix_ms < until - TRAIL_MS) continue;
      for (const { id, x, y } of line.tracks) ways.get(id)?.push([x, y]);
    }
    const pieces = [];
    for (const track of tracks) {
      const way = ways.get(track.id);
      if (track.state === TRACK.TENTATIVE || way.length < 2) continue;
      way.push([track.x, track.y]);
      const step = Math.ceil(way.length / FADES.length);
      FADES.forEach((opacity, index) => {
        const piece = way.slice(index * step, (index + 1) * step + 1);
        if (piece.length > 1) {
          pieces.push(
            svg("path", { class: "trail", d: path(piece), style: `--c:var(--p${track.id % HUES})`, opacity }),
          );
        }
      });
    }
    this.layers.trails.replaceChildren(...pieces);
  }
}
