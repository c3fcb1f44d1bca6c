// Converts figures whose names end in units to rows of text, for documents without a fixed schema. Pure functions.

import { MISSING, number } from "../../elements/format.js";

/** @type {[string, string, number][]} suffix of the name, unit, decimals */
const UNITS = [
  ["_deg", "°", 4],
  ["_px", " px", 3],
  ["_mm", " mm", 2],
  ["_ms", " ms", 2],
  ["_hz", " Hz", 1],
  ["_utc", "", 0],
  ["_m", " m", 4],
  ["_s", " s", 2],
  ["_v", " V", 3],
  ["_rel", "", 5],
  ["_lsb", " DAC steps", 2],
];

const SMALL_M = 0.02; // shorter lengths are given in millimetres

/**
 * @param {Record<string, unknown>} document
 * @param {string[]} [without] names to leave out
 * @returns {[string, string][]}
 */
export function facts(document, without = []) {
  return Object.entries(document)
    .filter(
      ([name, value]) => !without.includes(name) && value !== null && value !== undefined && !name.endsWith("_url"),
    )
    .map(([name, value]) => [title(name), valueText(value, name)]);
}

/** Return the sentences among a document's values. @param {Record<string, unknown>} document */
export function sentences(document) {
  return Object.values(document)
    .filter((value) => typeof value === "string" && value.includes(" "))
    .map(String);
}

/** Return the names of those sentences, which need no row of their own. @param {Record<string, unknown>} document */
export function sentenceNames(document) {
  return Object.keys(document).filter(
    (name) => typeof document[name] === "string" && String(document[name]).includes(" "),
  );
}

const WORDS = Object.freeze(
  /** @type {Record<string, string>} */ ({
    loo_deg: "Error on poses left out",
    rectify_loo_px: "Rectification, poses left out",
    volts_roundtrip_max_lsb: "Volts to angle to volts",
    pointing_difference_px: "Pointing differs by",
    epipolar_difference_px: "Rows differ by",
    disparity_difference_px: "Disparity differs by",
    wide_px: "Wide picture differs by",
    baseline_m: "Baseline differs by",
    distance_m: "At the distance",
    print_m: "Distance by the markers’ print",
    print_scatter_m: "Scatter of that",
    tape_m: "Distance by tape",
    rms_deg: "Parallax, RMS",
    station: "Measured at the station",
    largest_deg: "Parallax, largest",
    corrected: "Taken out",
  }),
);

/** @param {string} name */
function title(name) {
  const known = WORDS[name];
  if (known) return known;
  const [ending] = UNITS.find(([each]) => name.endsWith(each)) ?? [""];
  const words = (ending ? name.slice(0, -ending.length) : name).replaceAll("_", " ");
  return words.charAt(0).toUpperCase() + words.slice(1);
}

/** @param {unknown} value @param {string} name @returns {string} */
function valueText(value, name) {
  const [, unit, decimals] = UNITS.find(([each]) => name.endsWith(each)) ?? ["", "", 3];
  if (typeof value === "number" && unit === " m" && value !== 0 && Math.abs(value) < SMALL_M)
    return `${number(value * 1000, 2)} mm`;
  if (typeof value === "number") return number(value, Number.isInteger(value) ? 0 : decimals) + unit;
  if (typeof value === "boolean") return value ? "yes" : "no";
  if (typeof value === "string") return value;
  if (Array.isArray(value)) return value.map((each) => valueText(each, name)).join(", ");
  if (value && typeof value === "object") {
    return Object.entries(value)
      .map(([part, each]) => `${title(part).toLowerCase()} ${valueText(each, hasUnit(part) ? part : name)}`)
      .join(", ");
  }
  return MISSING;
}

/**
 * Return the nested documents, such as one for each station.
 * @param {Record<string, unknown>} document
 * @returns {[string, Record<string, unknown>][]}
 */
export function parts(document) {
  return Object.entries(document).flatMap(([name, value]) =>
    value && typeof value === "object" && !Array.isArray(value)
      ? [[name, /** @type {Record<string, unknown>} */ (value)]]
      : [],
  );
}

/** @param {string} name */
function hasUnit(name) {
  return UNITS.some(([each]) => name.endsWith(each));
}
