// Decides whether a click or a rectangle corrects an existing target, which then takes the new answer.

/**
 * @import { FixationRequest, TargetDocument } from "#api"
 * @import { ConsoleState } from "#page"
 */

export const NEAR_CSS_PX = 12; // the half diagonal of a mark's diamond, and half as much again for a finger

/**
 * Return the request with the id of the fixation that it corrects, if it corrects one.
 * @param {FixationRequest} request
 * @param {Pick<ConsoleState, "targets" | "hidden_targets">} state
 * @param {number} near_px the distance from a target within which a click corrects it, sensor px
 * @returns {FixationRequest}
 */
export function withCorrected(request, { targets, hidden_targets }, near_px) {
  const shown = (targets ?? []).filter(({ id }) => !hidden_targets.includes(id));
  const target = request.pixel
    ? nearest(shown, request.pixel, near_px)
    : request.rectangle
      ? only(shown, request.rectangle)
      : null;
  return target ? { ...request, corrects: target.fixation_id } : request;
}

/** @param {TargetDocument[]} targets @param {{x_px: number, y_px: number}} pixel @param {number} near_px */
function nearest(targets, { x_px, y_px }, near_px) {
  const away = (/** @type {TargetDocument} */ target) =>
    Math.hypot((target.x_px ?? NaN) - x_px, (target.y_px ?? NaN) - y_px);
  const near = targets.filter((target) => away(target) <= near_px);
  return near.sort((a, b) => away(a) - away(b))[0] ?? null;
}

/**
 * Return the target inside a rectangle; null where there are none or several, because the meant one is unknown.
 * @param {TargetDocument[]} targets
 * @param {{x_px: number, y_px: number, width_px: number, height_px: number}} box
 */
function only(targets, { x_px, y_px, width_px, height_px }) {
  const inside = targets.filter(
    ({ x_px: x, y_px: y }) =>
      x !== null && y !== null && x >= x_px && x <= x_px + width_px && y >= y_px && y <= y_px + height_px,
  );
  return inside.length === 1 ? (inside[0] ?? null) : null;
}
