// The plots of the loop's last looks: which looks are kept, and the parts of each curve. Pure functions.

import { runsOf } from "../../elements/runs.js";
import { AXES } from "./words.js";

/**
 * @import { LoopSample } from "#api"
 * @import { BandPoint, PlotSpec } from "../../elements/plot.js"
 */

export const SPAN_S = 30;
const MOST_POINTS = 150; // a curve; the plot is 320 px wide
const LEAST_DEG = 0.001; // errors far below a pixel of a fovea must not fill the plot
const AXIS_X = { name: "before the last look, s", from: -SPAN_S, to: 0 };

/** Return the looks of the last 30 s. @param {LoopSample[]} samples oldest first */
export function recent(samples) {
  const first_s = (samples.at(-1)?.t_s ?? 0) - SPAN_S;
  return samples.filter(({ t_s }) => t_s >= first_s);
}

/** Return the errors of all axes over the time before the last look. @param {LoopSample[]} samples @returns {PlotSpec} */
export function errorPlot(samples) {
  const shown = thinned(samples);
  const curves = AXES.map(({ name }, index) => ({
    name,
    colour: `--plan-${index}`,
    runs: runsOf(points(shown, ({ error_deg }) => error_deg?.[index] ?? null)),
  }));
  const y = { name: "error, °", least: LEAST_DEG };
  return { words: `Errors of ${samples.length} looks`, height: 190, x: AXIS_X, y, curves };
}

/** Return the distance over the time before the last look. @param {LoopSample[]} samples @returns {PlotSpec} */
export function distancePlot(samples) {
  const runs = runsOf(
    points(
      thinned(samples),
      ({ distance_m }) => distance_m,
      ({ distance_sigma_m }) => distance_sigma_m ?? 0,
    ),
  );
  const name = "distance, m";
  const curves = [{ name, colour: "--accent", runs }];
  return { words: "Distance with its error", height: 190, x: AXIS_X, y: { name }, curves };
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
