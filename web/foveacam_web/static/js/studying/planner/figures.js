// Shows the figures of a plan: ring, probabilities, free area on the map, or a sentence when the set is empty.

import { figures, show } from "../../elements/parts.js";
import { h, html } from "../../elements/dom.js";
import { number } from "../../elements/format.js";
import { plainly } from "../../devices/rig/scale.js";
import { makeCurve } from "./curve.js";
import { area, chance, length } from "./words.js";

/**
 * @template T
 * @typedef {import("#page").Answered<T>} Answered
 */
/** @import { MapDocument, RegionsDocument, RingDocument, StandoffDocument } from "#api" */

/** Build the figures of the ring and the probabilities. */
export function makeChances() {
  const curve = makeCurve();
  const [ring, chances] = [h("div", { class: "stack" }), h("div", { class: "stack" })];
  const element = h("div", { class: "stack" }, ring, curve.element, chances);
  return {
    element,
    show: (/** @type {Answered<StandoffDocument>} */ { document, stale, problem }) => {
      element.hidden = document === null;
      element.classList.toggle("stale", stale || problem !== null);
      if (!document) return;
      show(ring, figures(ringRows(document.ring)));
      curve.show(document, stale || problem !== null);
      show(
        chances,
        figures([
          ["P_succ over the domain", chance(document.success)],
          ["a metre more of D_max adds", chance(document.success_slope_per_m)],
          ["line clear at D_max", chance(document.clear_at_outer)],
          ["line clear at the nearest", chance(document.clear_at_inner)],
          ["seen part of the ring, on average", area(document.expected_area_m2)],
          ["domain", area(document.domain_m2)],
        ]),
      );
    },
  };
}

/** @param {RingDocument} ring @returns {[string, string][]} */
function ringRows({ resolution_mrad, d_max_m, inner_m, area_m2 }) {
  return [
    ["D_max", length(d_max_m)],
    ["nearest", length(inner_m)],
    ["ring without obstacles", area(area_m2)],
    ["angle of the feature at D_max", `${plainly(resolution_mrad)} mrad`],
  ];
}

/** Build the figures of the free area on the map. */
export function makeRoom() {
  const [table, each] = [h("div", { class: "stack" }), h("div", { class: "scroll-x" })];
  const element = h(
    "div",
    { class: "stack" },
    table,
    each,
    html`<p class="why">
      A region is where its own target is in sight and does not notice; what other targets notice there is not part of
      it.
    </p>`,
  );
  return {
    element,
    show: (
      /** @type {Answered<RegionsDocument>} */ { document, stale, problem },
      /** @type {MapDocument | null} */ map,
    ) => {
      element.hidden = document === null || map === null;
      element.classList.toggle("stale", stale || problem !== null);
      if (!document || !map) return;
      const [x0 = 0, y0 = 0, x1 = 0, y1 = 0] = map.bounds_m;
      const ground_m2 = (x1 - x0) * (y1 - y0);
      const { multi_m2, single_m2, weighted_m2 } = document.areas;
      const several = document.regions.length > 1;
      show(
        table,
        figures([
          [several ? "multi: any target in sight" : "the target is in sight", area(multi_m2)],
          ...(several
            ? /** @type {[string, string][]} */ ([
                ["single: mean of the targets’ own", area(single_m2)],
                ["weighted by the number in sight", area(weighted_m2)],
              ])
            : []),
          ["of the map", `${number((100 * multi_m2) / ground_m2, 1)} %`],
        ]),
      );
      show(
        each,
        several &&
          multi_m2 > 0 &&
          html`<table class="compare">
            <thead><tr>${["target", "area", "of its ring"].map((text) => html`<th>${text}</th>`)}</tr></thead>
            <tbody>
              ${document.regions.map(
                ({ target, area_m2, ring_share }) =>
                  html`<tr>
                  <th scope="row">${String(target)}</th>
                  <td>${area(area_m2)}</td>
                  <td>${ring_share === null ? "–" : `${number(100 * ring_share, 1)} %`}</td>
                </tr>`,
              )}
            </tbody>
          </table>`,
      );
    },
  };
}
