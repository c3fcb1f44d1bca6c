// Texts of the calibration page about displays: the patterns that it offers, and each display's state. Pure functions.

import { number } from "../../../elements/format.js";

/**
 * @import { DisplayDocument } from "#api"
 * @import { DisplayPattern, PatternField, PatternKind } from "#page"
 */

/** @type {Readonly<Record<PatternKind, string>>} */
export const PATTERN_NAMES = Object.freeze({
  charuco: "ChArUco board",
  checkerboard: "Checkerboard",
  markers: "Three markers (mirrors)",
  marker: "One marker",
});

/** @type {Readonly<Record<PatternKind, PatternField[]>>} */
export const FIELDS_OF = Object.freeze({
  charuco: ["columns", "rows", "square_mm", "marker_mm"],
  checkerboard: ["columns", "rows", "square_mm"],
  markers: ["side_mm", "spacing_mm"],
  marker: ["id", "side_mm"],
});

/** @type {[string, string][]} */
export const PAPER_NAMES = [
  ["A4", "A4"],
  ["A3", "A3"],
  ["Letter", "Letter"],
];

/** Return the path of a pattern's print. @param {DisplayPattern} pattern @param {string} paper */
export function printPath(pattern, paper) {
  const values = Object.entries({ ...pattern, paper }).map(([name, value]) => [name, String(value)]);
  return `/displays/pattern.pdf?${new URLSearchParams(values)}`;
}

/**
 * Return the pattern that the fields describe; null while one of them is empty.
 * @param {PatternKind} kind
 * @param {(name: PatternField) => number | null} value
 * @returns {DisplayPattern | null}
 */
export function patternOf(kind, value) {
  const values = FIELDS_OF[kind].map((name) => [name, value(name)]);
  if (values.some(([, found]) => found === null)) return null;
  return /** @type {DisplayPattern} */ ({ kind, ...Object.fromEntries(values) });
}

/** @param {number | null} width_mm @param {number | null} height_mm */
export function sizeWords(width_mm, height_mm) {
  return width_mm === null || height_mm === null ? "" : `${number(width_mm, 1)} × ${number(height_mm, 1)} mm`;
}

/** Say whether a display can show the pattern at its true size. @param {DisplayDocument} display */
export function displayState({ width_mm, height_mm, fits }) {
  if (width_mm === null) return { tone: "warn", text: "scale not set" };
  const size = sizeWords(width_mm, height_mm);
  return fits === false ? { tone: "bad", text: `does not fit on ${size}` } : { tone: "good", text: size };
}
