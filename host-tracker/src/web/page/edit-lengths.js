// How long the sides of what is drawn are, and at which angle the last one stands.

import { svg } from "./shapes.js";
import { degrees, metres } from "./words.js";

/** Sides shorter than this on the screen have no room for a number, in pixels. */
const ROOM_PX = 36;

/** The length of each side, at its middle; `turned` adds the angle of the last one. */
export function lengths(points, closed, px, turned = false) {
  const ends = points.slice(1).map((to, index) => [points[index], to]);
  if (closed && points.length > 2) ends.push([points.at(-1), points[0]]);
  const last = turned ? points.length - 2 : -1;
  return ends.flatMap(([[ax, ay], [bx, by]], index) => {
    const length = Math.hypot(bx - ax, by - ay);
    if (length < ROOM_PX * px) return [];
    const angle = Math.round((Math.atan2(by - ay, bx - ax) * 180) / Math.PI);
    const words = [metres(length), ...(index === last ? [degrees(angle)] : [])].join(" · ");
    return [
      svg("text", {
        class: "length",
        x: (ax + bx) / 2,
        y: -(ay + by) / 2,
        dy: "-.4em",
        "text-anchor": "middle",
      }, words),
    ];
  });
}
