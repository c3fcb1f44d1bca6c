// Computations and texts of steering by hand: positions on a pad, steps of the keys, sentences. Pure functions.

import { number, sentence } from "../../elements/format.js";

/**
 * @import { EyePair, Point, SteerLimits, SteeringState, Volts } from "#page"
 * @typedef {{tone: "good" | "warn" | "plain", text: string}} StatusWords
 */

/** Half the range of the pad of directions, degrees: what the mirrors are specified for. */
export const GAZE_MOST_DEG = 10;

/** Directions of the arrow keys; +y is down, as in every picture. @type {Record<string, [number, number]>} */
const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

/** @param {number} value @param {number} most */
export function clamp(value, most) {
  return Math.min(most, Math.max(-most, value));
}

/**
 * Return the value at a place of a square pad, held within it.
 * @param {Point} at CSS px from its top left corner
 * @param {number} side its side, CSS px
 * @param {number} most the value at its edge
 * @returns {Point}
 */
export function valueOnPad({ x, y }, side, most) {
  const along = (/** @type {number} */ place) => clamp((2 * place) / side - 1, 1) * most;
  return { x: along(x), y: along(y) };
}

/**
 * Return where an arrow key steers to, or null for another key.
 * @param {Point} from
 * @param {string} key
 * @param {{step: number, most: number}} pad
 * @returns {Point | null}
 */
export function steppedBy({ x, y }, key, { step, most }) {
  const way = ARROWS[key];
  return way ? { x: clamp(x + way[0] * step, most), y: clamp(y + way[1] * step, most) } : null;
}

/** @param {Volts} volts @returns {Point} */
export function pointOf({ x_v, y_v }) {
  return { x: x_v, y: y_v };
}

/** @param {Point} point @returns {Volts} */
export function voltsOf({ x, y }) {
  return { x_v: x, y_v: y };
}

/**
 * Return the volts that a move of one eye's pad asks for.
 * @param {"left" | "right"} eye
 * @param {Point} to
 * @param {boolean} split whether each eye goes by its own pad
 * @returns {Partial<EyePair<Volts>>}
 */
export function voltsFor(eye, to, split) {
  const volts = voltsOf(to);
  return split ? { [eye]: volts } : { left: volts, right: volts };
}

/**
 * Return the state of steering in words.
 * @param {SteeringState | null} state null: not connected
 * @param {SteerLimits | null} limits
 * @returns {StatusWords}
 */
export function statusWords(state, limits) {
  if (!state) return { tone: "plain", text: "Not connected yet." };
  if (state.status === "steering") return { tone: "good", text: "You are steering." };
  if (state.status === "silent")
    return {
      tone: "warn",
      text: `The server received nothing from this page: the mirrors hold, and are parked after ${limits?.park_after_s ?? 3} s.`,
    };
  if (state.status === "ended")
    return { tone: "warn", text: `${sentence(state.reason ?? "steering has ended")} Let go, and press again.` };
  if (state.by) return { tone: "warn", text: `${state.by} steers by hand.` };
  return { tone: "plain", text: "Drag in a pad, or use its arrow keys." };
}

/** @param {number | null} distance_m */
export function distanceText(distance_m) {
  return distance_m === null ? "∞" : `${number(distance_m, distance_m < 10 ? 2 : 1)} m`;
}
