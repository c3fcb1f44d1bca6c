// What a gamepad's sticks ask for: dead zone, curve, speeds. Pure functions.

import { clamp } from "./words.js";

/**
 * @import { Point } from "#page"
 * @typedef {{buttons: readonly {pressed: boolean}[], axes: readonly number[], connected: boolean}} Pad what is read of a gamepad
 * @typedef {{held: boolean, left: Point, right: Point}} Reading deflections of both sticks, 0 … 1 either way
 */

const DEAD_ZONE = 0.15; // sticks rest a tenth off their middle
const CURVE = 2; // a half deflection gives a quarter of the speed
/** The dead-man: the button A, or a shoulder button. */
const DEAD_MAN = [0, 4, 5];
/** Speeds at full deflection. */
export const FULL_V_S = 60;
export const FULL_DEG_S = 4;

/**
 * Return a stick's deflection beyond its dead zone, on the curve; its direction stays.
 * @param {number} x
 * @param {number} y
 * @returns {Point}
 */
export function deflection(x, y) {
  const way = Math.hypot(x, y);
  if (!(way > DEAD_ZONE)) return { x: 0, y: 0 };
  const share = ((Math.min(1, way) - DEAD_ZONE) / (1 - DEAD_ZONE)) ** CURVE;
  return { x: (x / way) * share, y: (y / way) * share };
}

/** Return the first gamepad that is there. @param {readonly (Pad | null)[]} pads @returns {Pad | null} */
export function firstPad(pads) {
  return pads.find((pad) => pad?.connected) ?? null;
}

/** @param {Pad} pad @returns {Reading} */
export function reading({ buttons, axes }) {
  const [left_x = 0, left_y = 0, right_x = 0, right_y = 0] = axes;
  return {
    held: DEAD_MAN.some((button) => buttons[button]?.pressed),
    left: deflection(left_x, left_y),
    right: deflection(right_x, right_y),
  };
}

/**
 * Return where a stick has moved a target after some time.
 * @param {Point} from
 * @param {Point} stick its deflection
 * @param {{speed: number, most: number, dt_s: number}} how `speed`: a second at full deflection; `most`: the edge
 * @returns {Point}
 */
export function driven({ x, y }, stick, { speed, most, dt_s }) {
  return { x: clamp(x + stick.x * speed * dt_s, most), y: clamp(y + stick.y * speed * dt_s, most) };
}
