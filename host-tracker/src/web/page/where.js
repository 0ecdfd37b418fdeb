// Where a card or a tag is: the question to the tracker, its answer in words, and the names beside the tracks.

import { percent } from "./details.js";
import { ask } from "./net.js";
import { html } from "./shapes.js";

/** An answer in words. */
function inWords({ tracks, zones, at, heard_s, read_s }) {
  const ago = (s) => s < 1.5 ? "now" : `${Math.round(s)} s ago`;
  if (!tracks.length) {
    return `read ${ago(heard_s)}, and no person is known to have it${
      read_s == null ? "" : `; its last place was read ${ago(read_s)}`
    }`;
  }
  const place = zones?.length ? `, in ${zones.join(" and ")}` : at ? `, at ${at[0]}, ${at[1]} m` : "";
  const read = ago(heard_s);
  return `${percent(tracks[0].probability)} person ${tracks[0].track}${place}; read ${read}`;
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
      html("label", { for: "where-id" }, "Where is"),
      this.input,
      html("button", { className: "button", type: "submit" }, "Find"),
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
      this.answer.textContent = inWords(there);
      if (there.tracks.length) this.choose({ person: there.tracks[0].track });
    } catch (error) {
      this.answer.textContent = error.message;
    }
  }

  /** The likeliest name of each track in a frame, in words. */
  names(frame) {
    const ofDoors = (frame?.doors ?? []).flatMap((door) => door.names ?? []).map((name) => ({
      ...name,
      probability: name.likelihood,
      word: `card ${name.label}`,
    }));
    const ofSigns = (frame?.names ?? []).flatMap(({ label, tracks }) =>
      tracks.map((track) => ({ ...track, word: this.called.get(label) ?? `ID ${label}` }))
    );
    const words = new Map();
    for (
      const { track, word, probability } of [...ofDoors, ...ofSigns].sort((a, b) =>
        b.probability - a.probability
      )
    ) {
      if (!words.has(track)) words.set(track, `${word} ${Math.round(probability * 100)} %`);
    }
    return words;
  }
}
