// Plots values over another one, with a band of one standard error where it is known; gaps stay open.

import { html, svg } from "./dom.js";
import { number } from "./format.js";

/** @typedef {{x: number, y: number, sigma: number}} BandPoint */

const WIDTH = 320;
const PAD = { left: 52, right: 10, top: 8, bottom: 32 };
const TICKS = 4;
const LEAST_SHARE = 1e-4; // of the value: the axis of a flat curve must not magnify noise

/**
 * @param {BandPoint[][]} runs each without a gap; one has a point at least
 * @param {{from: number, to: number, x_name: string, y_name: string, words: string, height?: number, kinds?: string[], least?: number}} options
 *   `from`, `to`: the ends of the axis of x; `kinds`: the class of each run, where there are several curves;
 *   `least`: the least margin above and below them
 */
export function bandPlot(runs, { from, to, x_name, y_name, words, height = 150, kinds = [], least = 0 }) {
  const known = runs.flat();
  const low = Math.min(...known.map(({ y, sigma }) => y - sigma));
  const high = Math.max(...known.map(({ y, sigma }) => y + sigma));
  const margin = Math.max(0.05 * (high - low), LEAST_SHARE * Math.abs(high), least);
  const ends = { low: low - margin, high: high + margin };
  const floor = height - PAD.bottom;
  const atX = (/** @type {number} */ x) => PAD.left + ((x - from) / (to - from)) * (WIDTH - PAD.left - PAD.right);
  const atY = (/** @type {number} */ y) => floor - ((y - ends.low) / (ends.high - ends.low)) * (floor - PAD.top);
  const place = (/** @type {number} */ x, /** @type {number} */ y) => `${atX(x).toFixed(1)} ${atY(y).toFixed(1)}`;
  return html`<svg class="band-plot" viewBox="0 0 ${WIDTH} ${height}" role="img" aria-label=${words}>
    ${ticksOf(ends.low, ends.high).flatMap(({ at, text }) => [
      svg`<line class="grid" x1=${PAD.left} x2=${WIDTH - PAD.right} y1=${atY(at)} y2=${atY(at)}></line>`,
      svg`<text class="tick" x=${PAD.left - 5} y=${atY(at) + 3} text-anchor="end">${text}</text>`,
    ])}
    ${ticksOf(from, to).map(
      ({ at, text }) => svg`<text class="tick" x=${atX(at)} y=${floor + 13} text-anchor="middle">${text}</text>`,
    )}
    <text class="tick" x=${(WIDTH + PAD.left) / 2} y=${height - 4} text-anchor="middle">${x_name}</text>
    <text class="tick" transform="translate(10 ${floor / 2}) rotate(-90)" text-anchor="middle">${y_name}</text>
    ${runs.filter((run) => run.some(({ sigma }) => sigma > 0)).map((run) => svg`<path class="band" d=${bandOf(run, place)}></path>`)}
    ${runs.map(
      (run, index) =>
        svg`<path class=${`curve ${kinds[index] ?? ""}`} d=${`M${run.map(({ x, y }) => place(x, y)).join("L")}`}></path>`,
    )}
    ${runs.map(
      ([only, ...others], index) =>
        only &&
        others.length === 0 &&
        svg`<circle class=${`dot ${kinds[index] ?? ""}`} cx=${atX(only.x)} cy=${atY(only.y)} r="1.6"></circle>`,
    )}
  </svg>`;
}

/** @param {BandPoint[]} run @param {(x: number, y: number) => string} place */
function bandOf(run, place) {
  const side = (/** @type {number} */ sign) => run.map(({ x, y, sigma }) => place(x, y + sign * sigma));
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
