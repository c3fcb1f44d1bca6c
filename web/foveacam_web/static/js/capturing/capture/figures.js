// Shows the estimate of a plan: time and its parts, files, disk space, the share of the field that is seen.

import { figures, nothing } from "../../elements/parts.js";
import { changing, html } from "../../elements/dom.js";
import { count, number } from "../../elements/format.js";
import { percent, sizeText, spanRange, timeWords } from "./words.js";

/**
 * @import { Estimate, Store } from "#console"
 * @import { Child } from "../../elements/dom.js"
 * @typedef {import("#page").Answered<Estimate>} Answered
 */

const RESERVE_BYTES = 64 * 2 ** 20; // the server's reserve

/** @param {HTMLElement} place @param {Store} store */
export function mountFigures(place, store) {
  const show = changing(place, (/** @type {Estimate | null} */ document) =>
    document
      ? figuresOf(document)
      : [nothing("Time, size and footprints appear here as soon as the plan can be estimated.")],
  );
  store.on(["estimate"], ({ estimate }) => {
    place.classList.toggle("stale", estimate.stale);
    place.setAttribute("aria-busy", String(estimate.stale));
    show(
      estimate.document && {
        ...estimate.document,
        coverage: { ...estimate.document.coverage, footprints: [] },
        plan: shortened(estimate.document.plan),
      },
    );
  });
}

/**
 * Return the plan without its points: only their number is shown here.
 * @param {Estimate["plan"]} plan
 * @returns {Estimate["plan"]}
 */
function shortened(plan) {
  return plan.points.kind === "grid" ? plan : { ...plan, points: { ...plan.points, points: [] } };
}

/** @param {Estimate} estimate @returns {Child[]} */
function figuresOf(estimate) {
  return [
    html`<p class="budget">
      <strong class="number">${spanRange(estimate.duration_low_s, estimate.duration_high_s)}</strong>
      <span class="lead">${timeWords(estimate)}</span>
    </p>`,
    figures([...pointRows(estimate), ...roomRows(estimate), ...fieldRows(estimate)]),
  ];
}

/** @param {Estimate} estimate @returns {[string, Child][]} */
function pointRows({ points, shots, plan, distance_assumed }) {
  const scans = Math.max(1, plan.rail_positions_mm.length);
  const far =
    plan.verging.distance_m === "infinity"
      ? "∞"
      : plan.verging.distance_m === null
        ? "each its own"
        : `${number(plan.verging.distance_m, 2)} m`;
  return [
    ["Points", scans > 1 ? `${scans} × ${count(points / scans)} = ${count(points)}` : count(points)],
    ...(shots === points ? [] : /** @type {[string, Child][]} */ ([["Exposures", count(shots)]])),
    ["Eyes meet at", distance_assumed ? `${far}, assumed until measured` : far],
  ];
}

/** @param {Estimate} estimate @returns {[string, Child][]} */
function roomRows({ files, kinds, stored_bytes, raw_bytes, free_bytes }) {
  const tight = stored_bytes + RESERVE_BYTES > free_bytes;
  const smaller = stored_bytes < raw_bytes ? ` of ${sizeText(raw_bytes)} raw` : "";
  return [
    ["Files", `${count(files)} (${kinds.map((kind) => `${count(kind.files)} ${kind.kind}`).join(", ")})`],
    ["Size", `${sizeText(stored_bytes)}${smaller}`],
    [
      "Free on the disk",
      html`<span class=${tight ? "warn-text" : ""}>
        ${tight ? `${sizeText(free_bytes)}: too little` : sizeText(free_bytes)}
      </span>`,
    ],
  ];
}

/** @param {Estimate} estimate @returns {[string, Child][]} */
function fieldRows({ plan: { points }, coverage }) {
  const grid = points.kind === "grid" ? points : null;
  const overlaps = [coverage.overlap_across, coverage.overlap_down];
  const alone = overlaps.every((each) => each === null);
  const overlap = grid
    ? `${percent(coverage.overlap_across)} across, ${percent(coverage.overlap_down)} down`
    : `${percent(coverage.overlap_across)} with the nearest`;
  return [
    ...(grid
      ? /** @type {[string, Child][]} */ ([
          ["Field", `±${number(grid.half_width_deg, 1)}° × ±${number(grid.half_height_deg, 1)}°`],
        ])
      : []),
    [
      "Least overlap",
      alone ? "no neighbours" : html`<span class=${overlaps.includes(0) ? "warn-text" : ""}>${overlap}</span>`,
    ],
    ["Area seen by an eye", percent(coverage.seen_either)],
    ["Area seen by both", percent(coverage.seen_both)],
  ];
}
