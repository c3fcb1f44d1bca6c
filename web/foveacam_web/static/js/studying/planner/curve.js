// Plots the probability of success over D_max, with the current D_max and the slope there.

import { h, html, update } from "../../elements/dom.js";
import "../../elements/plot.js";
import { chance, length } from "./words.js";

/**
 * @import { StandoffDocument } from "#api"
 * @import { Curve, PlotSpec } from "../../elements/plot.js"
 */

const SLOPE_SHARE = 0.22; // of the axis, to each side
const UPRIGHT = 1 + 1e-9; // each place of a curve has one value: a line upright leans by this share

/** @returns {{element: HTMLElement, show: (document: StandoffDocument, stale: boolean) => void}} */
export function makeCurve() {
  const element = h("div", { class: "curve" });
  return {
    element,
    show: (document, stale) => {
      element.classList.toggle("stale", stale);
      update(element, html`<value-plot .spec=${specOf(document)}></value-plot>`);
    },
  };
}

/** @param {StandoffDocument} document @returns {PlotSpec} */
function specOf({ curve, ring, success, success_slope_per_m: slope }) {
  const last_m = curve.d_max_m[curve.d_max_m.length - 1] ?? 1;
  const top = topOf(Math.max(...curve.success, success));
  const at_m = ring.d_max_m;
  const shown = at_m <= last_m;
  const reach_m = SLOPE_SHARE * last_m;
  return {
    words: `Probability of success ${chance(success)} at D_max of ${length(at_m)}`,
    height: 240,
    x: { name: "D_max, m", from: 0, to: last_m },
    y: { name: "probability", span: { from: 0, to: top } },
    curves: [
      curveOf(
        "P_succ (Eq. 12)",
        "--left",
        curve.success.map((y, index) => [curve.d_max_m[index] ?? 0, y]),
      ),
      ring.inner_m < last_m && {
        ...curveOf("nearest", "--text-soft", [
          [ring.inner_m, 0],
          [ring.inner_m * UPRIGHT, top],
        ]),
        dash: [2, 3],
        mark: true,
      },
      shown &&
        !ring.empty && {
          ...curveOf(
            "slope at D_max (Eq. 13)",
            "--right",
            [-reach_m, reach_m].map((side_m) => [at_m + side_m, success + side_m * slope]),
          ),
          dash: [6, 3],
          mark: true,
        },
      shown && { ...curveOf("D_max", "--right", [[at_m, success]]), dot_px: 10, mark: true },
    ].filter((each) => each !== false),
  };
}

/** @param {string} name @param {string} colour @param {number[][]} places x and y of each @returns {Curve} */
function curveOf(name, colour, places) {
  return { name, colour, runs: [places.map(([x = 0, y = 0]) => ({ x, y, sigma: 0 }))] };
}

/** Return the end of the axis: a little above the highest value, 1 at most. @param {number} highest */
function topOf(highest) {
  return highest <= 0 ? 1 : Math.min(1, 1.15 * highest);
}
