// The curves of the loop's last looks: which looks are kept, and the parts of each curve. Pure functions.

import { runsOf } from "../../elements/runs.js";
import { AXES } from "./words.js";

/**
 * @import { LoopSample } from "#api"
 * @import { BandPoint } from "../../elements/band_plot.js"
 */

export const SPAN_S = 30;
const MOST_POINTS = 150; // a curve; the plot is 320 px wide

/** Return the looks of the last 30 s. @param {LoopSample[]} samples oldest first */
export function recent(samples) {
  const first_s = (samples.at(-1)?.t_s ?? 0) - SPAN_S;
  return samples.filter(({ t_s }) => t_s >= first_s);
}

/**
 * Return the errors of all axes over the time before the last look, each part of a curve with its axis.
 * @param {LoopSample[]} samples
 * @returns {{runs: BandPoint[][], kinds: string[]}}
 */
export function errorCurves(samples) {
  const shown = thinned(samples);
  const curves = AXES.map(({ axis }, index) => ({
    axis,
    runs: runsOf(points(shown, ({ error_deg }) => error_deg?.[index] ?? null)),
  }));
  return {
    runs: curves.flatMap(({ runs }) => runs),
    kinds: curves.flatMap(({ axis, runs }) => runs.map(() => axis)),
  };
}

/** Return the distance over the time before the last look. @param {LoopSample[]} samples */
export function distanceRuns(samples) {
  return runsOf(
    points(
      thinned(samples),
      ({ distance_m }) => distance_m,
      ({ distance_sigma_m }) => distance_sigma_m ?? 0,
    ),
  );
}

/** @param {LoopSample[]} samples */
function thinned(samples) {
  const every = Math.ceil(samples.length / MOST_POINTS);
  return samples.filter((_, index) => (samples.length - 1 - index) % every === 0);
}

/**
 * @param {LoopSample[]} samples
 * @param {(sample: LoopSample) => number | null} value
 * @param {(sample: LoopSample) => number} [sigma]
 * @returns {BandPoint[]}
 */
function points(samples, value, sigma = () => 0) {
  const last_s = samples.at(-1)?.t_s ?? 0;
  return samples.flatMap((sample) => {
    const y = value(sample);
    return y === null ? [] : [{ x: sample.t_s - last_s, y, sigma: sigma(sample) }];
  });
}
