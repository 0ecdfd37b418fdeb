// Where the picture under the map lies: pixels to metres of the site and back, and from two points on both. It draws nothing.
//
//   a pixel (u, v), v downwards ─▶ upper left corner + turned by turn_deg of (u, -v) · m_per_px

const turned = ([x, y], rad) => [
  x * Math.cos(rad) - y * Math.sin(rad),
  x * Math.sin(rad) + y * Math.cos(rad),
];
const rad = (deg) => (deg * Math.PI) / 180;
const off = ([ax, ay], [bx, by]) => [bx - ax, by - ay];

/** The place of a pixel. */
export function toSite({ x, y, turn_deg, m_per_px }, [u, v]) {
  const [dx, dy] = turned([u * m_per_px, -v * m_per_px], rad(turn_deg));
  return [x + dx, y + dy];
}

/** The pixel at a place. */
export function toPixel({ x, y, turn_deg, m_per_px }, at) {
  const [dx, dy] = turned(off([x, y], at), -rad(turn_deg));
  return [dx / m_per_px, -dy / m_per_px];
}

/** Where the picture lies when two of its pixels are at two places; null if two of either are one. */
export function laid(place, [a, b], [at, bt]) {
  const [du, dv] = off(a, b), [dx, dy] = off(at, bt);
  const pixels = Math.hypot(du, dv), metres = Math.hypot(dx, dy);
  if (!(pixels > 0) || !(metres > 0)) return null;
  const m_per_px = metres / pixels;
  const angle = Math.atan2(dy, dx) - Math.atan2(-dv, du);
  const turn_deg = Math.atan2(Math.sin(angle), Math.cos(angle)) * (180 / Math.PI);
  const [ax, ay] = toSite({ x: 0, y: 0, turn_deg, m_per_px }, a);
  return { ...place, x: at[0] - ax, y: at[1] - ay, turn_deg, m_per_px };
}

/** The same when two of its pixels are so far from each other, m: the first stays where it is. */
export function scaled(place, [a, b], metres) {
  const [at, bt] = [a, b].map((pixel) => toSite(place, pixel));
  const [dx, dy] = off(at, bt), far = Math.hypot(dx, dy);
  return far > 0 && metres > 0
    ? laid(place, [a, b], [at, [at[0] + dx / far * metres, at[1] + dy / far * metres]])
    : null;
}

/** Where a new picture lies: in the middle of what is shown, and three quarters as wide. */
export function begun([width, height], [left, low, right, high]) {
  const m_per_px = Math.min((right - left) / width, (high - low) / height) * 0.75;
  return {
    x: (left + right - width * m_per_px) / 2,
    y: (low + high + height * m_per_px) / 2,
    turn_deg: 0,
    m_per_px,
    width,
    height,
  };
}

/** The numbers by which a picture is laid: which each is `of` a place, and what another one would `change` of it; null where no picture
 * lies so. */
export const NUMBERS = {
  x: { of: ({ x }) => x, change: (x) => ({ x }) },
  y: { of: ({ y }) => y, change: (y) => ({ y }) },
  turn: { of: ({ turn_deg }) => turn_deg, change: (turn_deg) => ({ turn_deg }) },
  wide: {
    of: ({ m_per_px, width }) => m_per_px * width,
    change: (metres, { width }) => metres > 0 ? { m_per_px: metres / width } : null,
  },
};
