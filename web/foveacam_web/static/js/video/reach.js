// Computes where both eyes, one eye or none can look. Pure functions.

/**
 * @import { ReachDocument } from "#api"
 * @import { Corners, Point } from "#page"
 * @typedef {"both" | "left" | "right" | "none"} Seeing
 */

/** @type {Readonly<Record<Seeing, string>>} */
export const SEEING = Object.freeze({
  both: "both foveae",
  left: "left fovea only",
  right: "right fovea only",
  none: "beyond the mirrors' reach",
});

/** Return which eyes can look at a wide pixel. @param {ReachDocument} reach @param {Point} pixel @returns {Seeing} */
export function seeing(reach, pixel) {
  const left = holds(/** @type {Corners} */ (reach.left_px), pixel);
  const right = holds(/** @type {Corners} */ (reach.right_px), pixel);
  return left ? (right ? "both" : "left") : right ? "right" : "none";
}

/**
 * Return whether a closed outline contains a point, by counting the edges that a ray to the right crosses.
 * @param {Corners} outline
 * @param {Point} point
 */
function holds(outline, { x, y }) {
  let inside = false;
  outline.forEach(([x1, y1], index) => {
    const [x2, y2] = outline[(index + 1) % outline.length] ?? [x1, y1];
    if (y1 > y !== y2 > y && x < x1 + ((y - y1) / (y2 - y1)) * (x2 - x1)) inside = !inside;
  });
  return inside;
}
