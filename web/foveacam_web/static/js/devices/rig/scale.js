// Maps slider positions to values, linearly, by the root or logarithmically, and formats the values. Pure functions.

import { number } from "../../elements/format.js";

/**
 * @import { SpanDocument } from "#api"
 * @typedef {"linear" | "root" | "log"} ScaleKind `root`: half the way for a quarter of the range
 */

/** Number of steps of a slider. */
export const WAY = 1000;
const DECADES = [1e-3, 1e-2, 0.1, 1, 10, 100, 1000, 10_000, 100_000];

/** @param {SpanDocument} span @param {ScaleKind} kind @param {number} value @returns {number} its position, 0 … 1 */
export function shareOf({ low, high }, kind, value) {
  if (high <= low) return 0;
  if (kind === "log" && low > 0) return within(Math.log(Math.max(value, low) / low) / Math.log(high / low));
  const share = within((value - low) / (high - low));
  return kind === "root" ? Math.sqrt(share) : share;
}

/** @param {number} share */
function within(share) {
  return Math.min(1, Math.max(0, share));
}

/**
 * @param {SpanDocument} span
 * @param {ScaleKind} kind
 * @param {number} share 0 … 1
 * @returns {number} the value there, to three significant digits
 */
export function valueAt({ low, high }, kind, share) {
  if (share <= 0) return low;
  if (share >= 1) return high;
  const way = kind === "root" ? share ** 2 : share;
  const value = kind === "log" && low > 0 ? low * (high / low) ** share : low + (high - low) * way;
  return Number(value.toPrecision(3));
}

/** Return the powers of ten inside a span. @param {SpanDocument} span */
export function decades({ low, high }) {
  return DECADES.filter((decade) => decade >= low && decade <= high);
}

/** Format a value with four significant digits and no trailing zeros. @param {number} value */
export function plainly(value) {
  return String(Number(value.toPrecision(4)));
}

/** Format a span with its unit. @param {SpanDocument} span @param {string} unit */
export function spanText({ low, high }, unit) {
  const text = (/** @type {number} */ value) => (Number.isInteger(value) ? number(value, 0) : plainly(value));
  return `${text(low)} … ${text(high)}${unit && ` ${unit}`}`;
}

/**
 * Return whether the taken value differs from the requested one in its four significant digits.
 * @param {number} asked
 * @param {number} taken
 */
export function snapped(asked, taken) {
  return plainly(asked) !== plainly(taken);
}
