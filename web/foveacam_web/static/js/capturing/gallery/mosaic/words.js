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

/** Word the time left, rounded to what is known. @param {number | null} left_s */
export function leftOf(left_s) {
  if (left_s === null) return "";
  if (left_s < 8) return "a few seconds left";
  return left_s < 90 ? `about ${Math.ceil(left_s / 10) * 10} s left` : `about ${Math.round(left_s / 60)} min left`;
}
