// Plots a profile: depth over length, with a band of one standard error; unknown samples leave gaps.

import { html, svg } from "../dom.js";
import { number } from "../format.js";

/** @import { ProfileDocument } from "#api" */

/** @typedef {{along_m: number, z_m: number, z_sigma_m: number}} Known */

const WIDTH = 320;
const HEIGHT = 150;
const PAD = { left: 52, right: 10, top: 8, bottom: 32 };
const TICKS = 4;
const LEAST_SHARE = 1e-4; // of the depth: the axis of a flat profile must not magnify noise

/** @param {ProfileDocument} profile */
export function profilePlot(profile) {
  const runs = runsOf(profile);
  const known = runs.flat();
  const long_m = profile.samples.at(-1)?.along_m || 1;
  const low_m = Math.min(...known.map(({ z_m, z_sigma_m }) => z_m - z_sigma_m));
  const high_m = Math.max(...known.map(({ z_m, z_sigma_m }) => z_m + z_sigma_m));
  const margin_m = Math.max(0.05 * (high_m - low_m), LEAST_SHARE * high_m);
  const span = { low: low_m - margin_m, high: high_m + margin_m };
  const x = (/** @type {number} */ along_m) => PAD.left + (along_m / long_m) * (WIDTH - PAD.left - PAD.right);
  const y = (/** @type {number} */ z_m) =>
    HEIGHT - PAD.bottom - ((z_m - span.low) / (span.high - span.low)) * (HEIGHT - PAD.top - PAD.bottom);
  const words = `Depth along ${number(long_m, 3)} m: from ${number(low_m, 3)} to ${number(high_m, 3)} m`;
  return html`<svg class="profile-plot" viewBox="0 0 ${WIDTH} ${HEIGHT}" role="img" aria-label=${words}>
    ${ticksOf(span.low, span.high).flatMap(({ at, text }) => [
      svg`<line class="grid" x1=${PAD.left} x2=${WIDTH - PAD.right} y1=${y(at)} y2=${y(at)}></line>`,
      svg`<text class="tick" x=${PAD.left - 5} y=${y(at) + 3} text-anchor="end">${text}</text>`,
    ])}
    ${ticksOf(0, long_m).map(
      ({ at, text }) =>
        svg`<text class="tick" x=${x(at)} y=${HEIGHT - PAD.bottom + 13} text-anchor="middle">${text}</text>`,
    )}
    <text class="tick" x=${(WIDTH + PAD.left) / 2} y=${HEIGHT - 4} text-anchor="middle">along the line, m</text>
    <text class="tick" transform="translate(10 ${(HEIGHT - PAD.bottom) / 2}) rotate(-90)" text-anchor="middle">
      Z, m
    </text>
    ${runs.map((run) => svg`<path class="band" d=${bandOf(run, x, y)}></path>`)}
    ${runs.map(
      (run) =>
        svg`<path
        class="curve"
        d=${`M${run.map(({ along_m, z_m }) => `${x(along_m).toFixed(1)} ${y(z_m).toFixed(1)}`).join("L")}`}
      ></path>`,
    )}
  </svg>`;
}

/** Split the samples into runs without a gap. @param {ProfileDocument} profile */
function runsOf({ samples }) {
  /** @type {Known[][]} */
  const runs = [[]];
  for (const { along_m, z_m, z_sigma_m } of samples) {
    if (z_m === null) runs.push([]);
    else runs.at(-1)?.push({ along_m, z_m, z_sigma_m: z_sigma_m ?? 0 });
  }
  return runs.filter((run) => run.length > 0);
}

/** @param {Known[]} run @param {(along_m: number) => number} x @param {(z_m: number) => number} y */
function bandOf(run, x, y) {
  const side = (/** @type {number} */ sign) =>
    run.map(({ along_m, z_m, z_sigma_m }) => `${x(along_m).toFixed(1)} ${y(z_m + sign * z_sigma_m).toFixed(1)}`);
  return `M${[...side(1), ...side(-1).reverse()].join("L")}Z`;
}

/** Return about four round values between two ends, as texts. @param {number} low @param {number} high */
function ticksOf(low, high) {
  const rough = (high - low) / TICKS;
  const decade = 10 ** Math.floor(Math.log10(rough));
  const step = decade * ([1, 2, 5, 10].find((part) => part * decade >= rough) ?? 10);
  const decimals = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  const first = Math.ceil(low / step - 1e-9);
  const count = Math.floor(high / step + 1e-9) - first + 1;
  return Array.from({ length: count }, (_, index) => ({
    at: (first + index) * step,
    text: number((first + index) * step, decimals),
  }));
}
