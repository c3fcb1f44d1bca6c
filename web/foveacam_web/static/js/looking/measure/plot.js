// Plots a profile: depth over length; unknown samples leave gaps.

import { html } from "../../elements/dom.js";
import { number } from "../../elements/format.js";
import "../../elements/plot.js";

/**
 * @import { ProfileDocument } from "#api"
 * @import { BandPoint, PlotSpec } from "../../elements/plot.js"
 */

/** @param {ProfileDocument} profile */
export function profilePlot(profile) {
  const runs = runsOf(profile);
  const known = runs.flat();
  const long_m = profile.samples.at(-1)?.along_m || 1;
  const low_m = Math.min(...known.map(({ y, sigma }) => y - sigma));
  const high_m = Math.max(...known.map(({ y, sigma }) => y + sigma));
  /** @type {PlotSpec} */
  const spec = {
    words: `Depth along ${number(long_m, 3)} m: from ${number(low_m, 3)} to ${number(high_m, 3)} m`,
    x: { name: "along the line, m", from: 0, to: long_m },
    y: { name: "Z, m" },
    curves: [{ name: "Z, m", colour: "--accent", runs }],
  };
  return html`<value-plot .spec=${spec}></value-plot>`;
}

/** Split the samples into runs without a gap. @param {ProfileDocument} profile */
function runsOf({ samples }) {
  /** @type {BandPoint[][]} */
  const runs = [[]];
  for (const { along_m, z_m, z_sigma_m } of samples) {
    if (z_m === null) runs.push([]);
    else runs.at(-1)?.push({ x: along_m, y: z_m, sigma: z_sigma_m ?? 0 });
  }
  return runs.filter((run) => run.length > 0);
}
