// A guarded door as it is drawn: which zone is before it, and what it is until somebody says otherwise.
//
//        inside
//   ━━━━●━━━━●━━━━━     the line of the door, between its ends
//   ┌──────────────┐    the zone that ends there is the one before it
//   │     area     │

import { FAIL } from "./names.js";

/** What a door is that its file says nothing more of, as `tracking/src/site/door.rs` has it; `door-part_test.js` compares them. */
export const DOOR = {
  people_max: 7,
  ask_s: 30,
  check_s: 4,
  tries_max: 3,
  pass_s: 8,
  next_s: 3,
  close_s: 6,
  passback_s: 60,
  exit_s: 5,
};

/** Zones whose sides are as near as this are at one place, in metres: a step of the editor's grid. */
const SAME_M = 0.05;
/** A reader hangs so far beside the door that its leaf does not hide it, in metres. */
const BESIDE_M = 0.25;

/** How far a place is from a line between two others. */
function apart([x, y], [ax, ay], [bx, by]) {
  const [along, up] = [bx - ax, by - ay], length2 = along ** 2 + up ** 2;
  const share = length2 ? Math.min(Math.max(((x - ax) * along + (y - ay) * up) / length2, 0), 1) : 0;
  return Math.hypot(ax + share * along - x, ay + share * up - y);
}

/** The name of the zone before a door: of those whose sides are nearest to its middle a secure one, or the first; empty if there is none. */
export function zoneBefore([from, to], zones) {
  const middle = [(from[0] + to[0]) / 2, (from[1] + to[1]) / 2];
  const far = ({ polygon }) =>
    Math.min(...polygon.map((corner, index) => apart(middle, corner, polygon.at(index - 1))));
  const all = zones.map((zone) => ({ zone, steps: Math.round(far(zone) / SAME_M) }));
  all.sort((one, other) => one.steps - other.steps || Number(other.zone.secure) - Number(one.zone.secure));
  return all[0]?.zone.name ?? "";
}

/** A new door with a line. */
export const newDoor = (name, line, zones) => ({
  name,
  zone: zoneBefore(line, zones),
  fail: FAIL.SECURE,
  ...DOOR,
});

/** Where cards are shown beside a door, until somebody says where. */
export function besideDoor([from, to]) {
  const length = Math.hypot(to[0] - from[0], to[1] - from[1]) || 1;
  return [0, 1].map((axis) =>
    Math.round((to[axis] + ((to[axis] - from[axis]) / length) * BESIDE_M) * 1000) / 1000
  );
}

/** How far both ends have gone, if they have gone alike; null if the line is another one. */
export function gone(before, after) {
  const by = [0, 1].map((end) => [0, 1].map((axis) => after[end][axis] - before[end][axis]));
  const alike = by[0].every((metres, axis) => Math.abs(metres - by[1][axis]) < 0.002);
  return alike ? by[0] : null;
}
