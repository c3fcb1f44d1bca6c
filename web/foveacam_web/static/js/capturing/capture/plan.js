// Converts a draft to the plan that is sent, and finds what is missing in it. Pure functions.

import { directionOf } from "../../video/angles.js";

/**
 * @import { WideLensDocument } from "#api"
 * @import { Estimate, PlanDraft, PlanRequest, Trouble, ViewSize } from "#page"
 * @typedef {Required<import("#api").GridPoints>} GridPoints
 */

/** Sec. 5.1: five places along the x axis, each with a full scan. */
export const PAPER_RAIL_MM = Object.freeze([-300, -100, 0, 100, 300]);

/**
 * Return the plan of a draft and its faults; a plan with faults is not sent.
 * @param {PlanDraft} draft
 * @param {ViewSize | null} view size of one fovea's view, null until it is known
 * @returns {{plan: PlanRequest, troubles: Trouble[]}}
 */
export function planOf(draft, view) {
  /** @type {Trouble[]} */
  const troubles = [];
  const points =
    draft.source === "grid"
      ? gridOf(draft, view, troubles)
      : /** @type {const} */ ({ kind: "set_points", points: draft.text });
  if (draft.mode === "given" && draft.distance_m === null)
    troubles.push({ place: "distance", words: "Give the distance in metres." });
  if (draft.stack_frames === null)
    troubles.push({ place: "stack", words: "Give a whole number of frames; 1 is no stack." });
  const { each_point, exposures_ms, stack_frames, stack_keep, wide, rail_positions_mm } = draft;
  const verging =
    draft.mode === "scene"
      ? { mode: draft.mode, distance_m: null, each_point }
      : {
          mode: /** @type {const} */ ("given"),
          distance_m: draft.mode === "parallel" ? /** @type {const} */ ("infinity") : draft.distance_m,
          each_point,
        };
  return {
    plan: { points, verging, exposures_ms, stack_frames: stack_frames ?? 1, stack_keep, wide, rail_positions_mm },
    troubles,
  };
}

/** @param {PlanDraft} draft @param {ViewSize | null} view @param {Trouble[]} troubles @returns {GridPoints} */
function gridOf(draft, view, troubles) {
  const { columns, rows, centre_ax_deg, centre_ay_deg, order } = draft;
  if (columns === null || rows === null) troubles.push({ place: "size", words: "Give how many columns and rows." });
  if (centre_ax_deg === null || centre_ay_deg === null)
    troubles.push({ place: "centre", words: "Give both angles of the centre." });
  return {
    kind: "grid",
    columns: columns ?? 1,
    rows: rows ?? 1,
    centre_ax_deg: centre_ax_deg ?? 0,
    centre_ay_deg: centre_ay_deg ?? 0,
    ...extentOf(draft, view, troubles),
    order,
  };
}

/**
 * @param {PlanDraft} draft
 * @param {ViewSize | null} view
 * @param {Trouble[]} troubles
 * @returns {Pick<GridPoints, "half_width_deg" | "half_height_deg">}
 */
function extentOf({ field, across, down, columns, rows }, view, troubles) {
  if (field === "all") return { half_width_deg: null, half_height_deg: null };
  const wanting = (/** @type {string} */ words) => {
    troubles.push({ place: "field", words });
    return { half_width_deg: null, half_height_deg: null };
  };
  if (across === null || down === null) return wanting("Give both numbers, or choose all that both eyes reach.");
  if (field === "extent") return { half_width_deg: across, half_height_deg: down };
  if (field === "step") return { half_width_deg: halfOf(columns, across), half_height_deg: halfOf(rows, down) };
  if (across >= 100 || down >= 100) return wanting("Views that overlap wholly are one view: give less than 100 %.");
  if (!view) return wanting("The size of a view is not known before the first estimate.");
  return {
    half_width_deg: halfOf(columns, view.width_deg * (1 - across / 100)),
    half_height_deg: halfOf(rows, view.height_deg * (1 - down / 100)),
  };
}

/**
 * Return half the extent of so many points with this step; a single point counts as one step, because a plan needs an
 * extent.
 * @param {number | null} count
 * @param {number} step_deg
 */
function halfOf(count, step_deg) {
  return Number(((step_deg * Math.max(1, (count ?? 1) - 1)) / 2).toFixed(6));
}

/** Overlap of neighbouring views that is offered where there is none: a mosaic finds its seams in it. */
export const OVERLAP_PERCENT = 20;

/** The fields of a plan whose views overlap, whatever its columns and rows. @type {Readonly<Partial<PlanDraft>>} */
export const OVERLAPPING = Object.freeze({
  source: "grid",
  field: "overlap",
  across: OVERLAP_PERCENT,
  down: OVERLAP_PERCENT,
});

/**
 * Return how many columns and rows a grid needs at least for its views to overlap in its own field.
 * @param {{half_width_deg: number | null, half_height_deg: number | null}} grid
 * @param {ViewSize} view
 */
export function denserGrid({ half_width_deg, half_height_deg }, view) {
  const steps = (/** @type {number | null} */ half_deg, /** @type {number} */ view_deg) =>
    1 + Math.ceil((2 * (half_deg ?? 0)) / (view_deg * (1 - OVERLAP_PERCENT / 100)));
  return { columns: steps(half_width_deg, view.width_deg), rows: steps(half_height_deg, view.height_deg) };
}

/**
 * Return the size of a fovea's view, measured on the middle footprint of an estimate.
 * @param {Estimate} estimate
 * @param {WideLensDocument} lens
 * @returns {ViewSize | null}
 */
export function viewSize({ coverage: { footprints } }, lens) {
  const middle = footprints[Math.floor(footprints.length / 2)];
  if (!middle) return null;
  const [a, b, c, d] = middle.left.map(([x, y]) => directionOf(lens, { x, y }));
  if (!a || !b || !c || !d) return null;
  const across = (/** @type {typeof a} */ from, /** @type {typeof a} */ to) =>
    Math.hypot(to.ax_deg - from.ax_deg, to.ay_deg - from.ay_deg);
  return { width_deg: (across(a, b) + across(d, c)) / 2, height_deg: (across(a, d) + across(b, c)) / 2 };
}

/**
 * Write a grid in the set-point language: its corners and an interpolation between them.
 * @param {GridPoints} grid with its extent
 */
export function asSetPoints({ columns, rows, centre_ax_deg, centre_ay_deg, half_width_deg, half_height_deg, order }) {
  const [x, y] = [half_width_deg ?? 0, half_height_deg ?? 0];
  const corner = (/** @type {number} */ right, /** @type {number} */ down) =>
    `${plain(centre_ax_deg + right * x)}, ${plain(centre_ay_deg + down * y)}`;
  return [
    "# right°, down°[, distance m][, shift°]",
    "# the corners, then all points between them",
    corner(-1, -1),
    corner(1, -1),
    corner(-1, 1),
    corner(1, 1),
    `@interpolate ${columns} ${rows}${order === "serpentine" ? " zigzag" : ""}`,
    "",
  ].join("\n");
}

/** @param {number} value */
function plain(value) {
  return String(Number(value.toFixed(4)));
}

/**
 * Return column and row of a grid's point, counted in the order of capture.
 * @param {GridPoints} grid
 * @param {number} number
 */
export function placeOf({ columns, order }, number) {
  const row = Math.floor(number / columns);
  const along = number % columns;
  return { row, column: order === "serpentine" && row % 2 === 1 ? columns - 1 - along : along };
}
