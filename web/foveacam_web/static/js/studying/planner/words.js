// Formats the planner's figures. Pure functions.

import { count, number } from "../../elements/format.js";

/** @import { MapPoint } from "#page" */

/** @param {number} value_m2 */
export function area(value_m2) {
  return `${value_m2 < 100 ? number(value_m2, 1) : count(Math.round(value_m2))} m²`;
}

/** Format a length with four significant digits. @param {number} value_m */
export function length(value_m) {
  return `${count(Number(value_m.toPrecision(4)))} m`;
}

/** @param {number} share */
export function chance(share) {
  return number(share, share > 0 && share < 0.01 ? 4 : 3);
}

/** @param {MapPoint} place @param {number[]} seen @param {number} all */
export function sightWords([x, y], seen, all) {
  const where = `x ${number(x, 1)}, y ${number(y, 1)} m`;
  if (seen.length === 0) return `${where}: no target is seen unnoticed from here.`;
  return `${where}: ${seen.length} of ${all} in sight (${seen.length === 1 ? "target" : "targets"} ${seen.join(", ")}).`;
}
