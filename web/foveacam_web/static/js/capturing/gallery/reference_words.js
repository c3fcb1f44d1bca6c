// Words for rail positions and the figures of a reference. Pure functions.

import { count, number } from "../../elements/format.js";

/** @import { MadeReference } from "#api" */

/** @param {number} length_m */
export function wholeMm(length_m) {
  return `${number(1000 * length_m, 0)} mm`;
}

/** @param {MadeReference} made */
export function referenceWords({ scan, stops, referenced, samples, baseline_m, short_baseline_m, comparison }) {
  const { rms_rel, bias_rel, stated_sigma_rel, wrong } = comparison;
  const rail_m = stops.find((stop) => stop.scan === scan)?.rail_m ?? 0;
  const apart = wrong > 0 ? `, without the ${percent(wrong, 1)} of samples that are off by more than 5 %` : "";
  return (
    `From ${wholeMm(rail_m)} on the rail, ${count(referenced)} of ${count(samples)} samples have a reference over ${wholeMm(baseline_m)} in the median, with a stated error of ${percent(stated_sigma_rel)}. ` +
    `The rig's own ${wholeMm(short_baseline_m)} are off it by ${percent(rms_rel)} rms, bias ${bias_rel > 0 ? "+" : ""}${percent(bias_rel)}${apart}.`
  );
}

/** @param {number} part of 1 */
function percent(part, decimals = 3) {
  return `${number(100 * part, decimals)}\u00a0%`;
}
