// What is read aloud of a counting line: `deno test --allow-read`.

import { drawCounts } from "./lines.js";
import { say } from "./words.js";

function equal(found, expected) {
  const [one, other] = [found, expected].map((value) => JSON.stringify(value));
  if (one !== other) throw new Error(`${one} is not ${other}`);
}

/** A line on the map, without a map. */
function group(line) {
  const attributes = {}, text = { textContent: "" };
  return {
    dataset: { line },
    attributes,
    classList: { toggle() {} },
    querySelector: () => text,
    getAttribute: (name) => attributes[name] ?? null,
    setAttribute: (name, value) => attributes[name] = value,
  };
}

Deno.test("a line says its name and its counts aloud, and where they are not known that", () => {
  const front = group("front");
  const aloud = (lines) => {
    drawCounts({ children: [front] }, lines);
    return front.attributes["aria-label"];
  };
  const figure = (count) => say("line.figure", { line: "front", count });
  const seen = { name: "front", in: 3, out: 2, state: "known" };
  equal(aloud([seen]), figure(say("map.in-out", { in: 3, out: 2 })));
  const unknown = figure(say("zone.unknown-count"));
  equal(aloud([{ ...seen, in: null, out: null, state: "unknown" }]), unknown);
  equal(aloud([]), unknown);
});
