// Texts and curves of a comparison of two depth backends. Pure functions.

import { MISSING, number } from "../../elements/format.js";

/**
 * @import { BackendComparisonDocument, ComparedBackend, DepthBackendsDocument } from "#api"
 * @import { BandPoint } from "../../elements/plot.js"
 */

/** Return the pair that is offered first: what is in use, and another one. @param {DepthBackendsDocument} found */
export function firstPair({ in_use, backends }) {
  const usable = backends.filter(({ problem }) => problem === null).map(({ name }) => name);
  const network = backends.find(({ kind, problem }) => kind === "network" && problem === null)?.name;
  const other = network && network !== in_use ? network : usable.find((name) => name !== in_use);
  return { first: in_use, second: other ?? in_use };
}

/** Return the names of those whose licence allows research alone. @param {DepthBackendsDocument} found @param {string[]} names */
export function researchOnly({ backends }, names) {
  return backends.filter(({ name, research_only }) => research_only && names.includes(name)).map(({ name }) => name);
}

/** @param {ComparedBackend} side @returns {[string, string][]} */
export function sideRows({ known, compute_ms, sigma_median_px, sha256 }) {
  return [
    ["Depth known", `${Math.round(100 * known)} % of the picture`],
    ["Its error, median", sigma_median_px === null ? MISSING : `${number(sigma_median_px, 3)} px`],
    ["Time", `${number(compute_ms, 0)} ms`],
    ["Graph, SHA-256", sha256 === null ? "built in" : `${sha256.slice(0, 12)}…`],
  ];
}

/** @param {BackendComparisonDocument} found @returns {[string, string][]} */
export function differenceRows({ known_both, median_px, spread_px, within_1, within_2 }) {
  return [
    ["Known to both", `${Math.round(100 * known_both)} %`],
    ["Median of the difference", signed(median_px)],
    ["Spread", spread_px === null ? MISSING : `${number(spread_px, 3)} px`],
    ["Within one stated error", share(within_1, "68 %")],
    ["Within two", share(within_2, "95 %")],
  ];
}

/**
 * Return the histogram of the difference, and the normal distribution that rightly stated errors would give, in shares
 * of a bin; the first and last bins also hold what is beyond.
 * @param {BackendComparisonDocument} found
 * @returns {{measured: BandPoint[], expected: BandPoint[]}}
 */
export function histogramCurves({ edges, shares }) {
  const middles = shares.map((_, index) => ((edges[index] ?? 0) + (edges[index + 1] ?? 0)) / 2);
  const width = (edges[1] ?? 0) - (edges[0] ?? 0);
  const normal = (/** @type {number} */ x) => (width * Math.exp(-0.5 * x * x)) / Math.sqrt(2 * Math.PI);
  return {
    measured: middles.map((x, index) => ({ x, y: shares[index] ?? 0, sigma: 0 })),
    expected: middles.map((x) => ({ x, y: normal(x), sigma: 0 })),
  };
}

/** @param {number | null} px */
function signed(px) {
  return px === null ? MISSING : `${px < 0 ? "−" : "+"}${number(Math.abs(px), 3)} px`;
}

/** @param {number | null} value @param {string} right */
function share(value, right) {
  return value === null ? MISSING : `${Math.round(100 * value)} % (${right} if stated rightly)`;
}
