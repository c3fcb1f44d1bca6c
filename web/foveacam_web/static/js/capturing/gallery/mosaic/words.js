// Formats sizes, shares and times of mosaics. Pure functions.

import { count, MISSING, number } from "../../../elements/format.js";

/** @param {number} width @param {number} height */
export function size(width, height) {
  return `${count(width)} × ${count(height)} px`;
}

/** @param {number | null | undefined} share */
export function percent(share) {
  if (share === null || share === undefined) return MISSING;
  return `${number(100 * share, share < 0.01 ? 2 : share < 0.1 ? 1 : 0)} %`;
}
