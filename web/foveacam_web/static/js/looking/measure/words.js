// Formats measurements with their standard errors. Pure functions.

import { MISSING, angle, distanceText, number } from "../../elements/format.js";

/**
 * @import { MeasurementDocument } from "#api"
 * @import { MeasureKind } from "#page"
 */

/** @type {Readonly<Record<MeasureKind, {title: string, hint: string}>>} */
export const KINDS = Object.freeze({
  point: { title: "Point", hint: "Click or tap a point" },
  length: { title: "Length", hint: "Click or tap two points, or drag from one to the other" },
  plane: { title: "Plane", hint: "Drag a rectangle over a flat part" },
  profile: { title: "Profile", hint: "Drag a line" },
});

/** Return at which of a measurement's places no depth is known yet. @param {boolean[]} seen of each place */
export function unseenWords(seen) {
  const unseen = seen.flatMap((is_seen, index) => (is_seen ? [] : [index]));
  if (seen.length === 1 || unseen.length === 0) return "The depth there is not known yet";
  if (unseen.length === seen.length) return "The depth of neither end is known yet";
  return `The depth of the ${unseen[0] === 0 ? "first" : "second"} end is not known yet`;
}

/** A share of the distance: a point that is known worse may be of what lies behind, or before, the thing itself. */
const DOUBTED_SHARE = 0.1;

/** Return which of a measurement's points is too uncertain to be of use; empty without one. @param {MeasurementDocument} measured */
export function doubtWords({ points }) {
  const index = points.findIndex(({ distance_m, distance_sigma_m }) => distance_sigma_m > DOUBTED_SHARE * distance_m);
  const point = points[index];
  if (!point) return "";
  const which = points.length === 1 ? "Its" : index === 0 ? "The first end’s" : "The second end’s";
  return `${which} distance is uncertain: ${distanceText(point.distance_m, point.distance_sigma_m)}. It may be of what lies behind.`;
}

/** Format the main value of a measurement. @param {MeasurementDocument} measured */
export function valueText({ length, plane, profile, points: [point] }) {
  if (length) return distanceText(length.length_m, length.length_sigma_m);
  if (plane)
    return `pan ${angle(plane.pan_deg, 1)}, tilt ${angle(plane.tilt_deg, 1)} ± ${number(plane.normal_sigma_deg, plane.normal_sigma_deg < 0.1 ? 2 : 1)}°`;
  if (profile) return `${number(profile.samples.at(-1)?.along_m, 3)} m long`;
  return point ? distanceText(point.distance_m, point.distance_sigma_m) : MISSING;
}

/**
 * Return the name and value of each figure of a measurement.
 * @param {MeasurementDocument} measured
 * @returns {[string, string][]}
 */
export function factsOf(measured) {
  const { length, plane, profile, points } = measured;
  /** @type {[string, string][]} */
  const facts = points.flatMap((point, index) =>
    axes(points.length > 1 ? `${"AB"[index]} ` : "", point.point_rig_m, point.point_sigma_m),
  );
  if (length)
    facts.push([
      "Errors",
      length.same_look ? "one look: what both points share is taken once" : "two looks: taken as independent",
    ]);
  if (plane) facts.push(...ofPlane(plane));
  if (profile) {
    facts.push(
      ["Median Z", distanceText(profile.median_z_m, profile.shared_sigma_m)],
      ["Depth known", `${number(100 * profile.known_fraction, 0)} % of the line`],
    );
  }
  const snapped = Math.max(0, ...points.map(({ snapped_px }) => snapped_px));
  if (snapped > 0) facts.push(["Moved", `${number(snapped, 1)} px to the nearest pixel with depth`]);
  const doubt = doubtWords(measured);
  if (doubt) facts.push(["Uncertain", doubt]);
  if (points.some(({ at_edge }) => at_edge)) facts.push(["Beware", "depth jumps here: it may be of either surface"]);
  return facts;
}

/** @param {import("#api").PlaneDocument} plane @returns {[string, string][]} */
function ofPlane(plane) {
  return [
    ["Pan", `${angle(plane.pan_deg)} ± ${number(plane.pan_sigma_deg, 2)}°`],
    ["Tilt", `${angle(plane.tilt_deg)} ± ${number(plane.tilt_sigma_deg, 2)}°`],
    ["Normal", plane.normal.map((part) => number(part, 4)).join(", ")],
    ["Off the rig", distanceText(plane.distance_m, plane.distance_sigma_m)],
    ["Flatness", `${millimetres(plane.flatness_m)} (middle 95 %)`],
    ["Residual", `${millimetres(plane.residual_rms_m)} rms, ${millimetres(plane.expected_rms_m)} expected`],
    ["Outliers", `${number(100 * plane.outlier_fraction, 1)} % of ${plane.pixels} pixels`],
  ];
}

/** @param {string} name @param {number[]} values_m @param {number[]} sigmas_m @returns {[string, string][]} */
function axes(name, values_m, sigmas_m) {
  return values_m.map((value_m, index) => [`${name}${"XYZ"[index]}`, distanceText(value_m, sigmas_m[index])]);
}

/** @param {number} metres */
function millimetres(metres) {
  return `${number(1000 * metres, metres < 0.01 ? 2 : 0)} mm`;
}
