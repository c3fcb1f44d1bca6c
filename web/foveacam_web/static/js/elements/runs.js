// Splits a curve over time where nothing was measured for long. Pure functions.

/** @import { BandPoint } from "./plot.js" */

const GAP_S = 2; // a longer time without a point leaves a gap, unless points are that rare
const GAP_INTERVALS = 4;

/**
 * Return the parts of a curve between its gaps.
 * @param {BandPoint[]} points `x` in seconds, ascending
 * @returns {BandPoint[][]}
 */
export function runsOf(points) {
  const gap_s = Math.max(GAP_S, GAP_INTERVALS * medianInterval_s(points));
  /** @type {BandPoint[][]} */
  const runs = [];
  points.forEach((point, index) => {
    const before = points[index - 1];
    if (!before || point.x - before.x > gap_s) runs.push([]);
    runs.at(-1)?.push(point);
  });
  return runs;
}

/** @param {BandPoint[]} points */
function medianInterval_s(points) {
  const intervals = points.slice(1).map(({ x }, index) => x - (points[index]?.x ?? x));
  return intervals.sort((a, b) => a - b)[Math.floor((intervals.length - 1) / 2)] ?? 0;
}
