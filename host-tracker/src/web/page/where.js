// Where a card or a tag is: the question to the tracker, its answer in words, and the names beside the tracks.

import { ask } from "./net.js";
import { html } from "./shapes.js";
import { ago, list, percent, say, tell } from "./words.js";

/** An answer in words. */
function inWords({ tracks, zones, at, heard_s, read_s }) {
  const since = (s) => s < 1.5 ? say("age.now") : ago(s), read = since(heard_s);
  if (!tracks.length) {
    return read_s == null
      ? say("where.nobody", { ago: read })
      : say("where.nobody-place", { ago: read, place: since(read_s) });
  }
  const [{ probability, track }] = tracks;
  const found = { share: percent(probability), track: String(track), ago: read };
  if (zones?.length) return say("where.person-zone", { ...found, zones: list(zones) });
  return at ? say("where.person-at", { ...found, x: at[0], y: at[1] }) : say("where.person", found);
}

export class Where {
  /** `choose` is called with {person} when an answer names one. */
  constructor(choose) {
    this.choose = choose;
    // What the visitor calls an ID, by the label that the tracker has for it: the tracker keeps hashes alone.
    this.called = new Map();
    this.input = html("input", { type: "search", id: "where-id", maxLength: 128, autocomplete: "off" });
    this.answer = html("p", { className: "fine", id: "where-answer", role: "status" });
    this.root = html(
      "form",
      { className: "where", id: "where", hidden: true, onsubmit: (event) => this.ask(event) },
      html("label", { for: "where-id" }, say("where.label")),
      this.input,
      html("button", { className: "button", type: "submit" }, say("where.find")),
      this.answer,
    );
  }

  /** The question makes sense once anything can be read, or was. */
  show(site, frame) {
    this.root.hidden = !(site.reader?.length || frame?.names?.length);
  }

  async ask(event) {
    event.preventDefault();
    const id = this.input.value.trim();
    if (!id) return;
    try {
      const there = await ask(`/api/where?id=${encodeURIComponent(id)}`);
      this.called.set(there.label, id);
      tell(this.answer, { message: inWords(there) });
      if (there.tracks.length) this.choose({ person: there.tracks[0].track });
    } catch (error) {
      tell(this.answer, error);
    }
  }

  /** The likeliest name of each track in a frame, in words. */
  names(frame) {
    const ofDoors = (frame?.doors ?? []).flatMap((door) => door.names ?? []).map((name) => ({
      ...name,
      probability: name.likelihood,
      key: "map.card",
    }));
    const ofSigns = (frame?.names ?? []).flatMap(({ label, tracks }) =>
      tracks.map((track) => {
        const called = this.called.get(label);
        return { ...track, label: called ?? label, key: called ? "map.called" : "map.id" };
      })
    );
    const words = new Map();
    for (
      const { track, key, label, probability } of [...ofDoors, ...ofSigns].sort((a, b) =>
        b.probability - a.probability
      )
    ) {
      if (!words.has(track)) words.set(track, say(key, { label, share: percent(probability) }));
    }
    return words;
  }
}
