// Steers by a gamepad while its dead-man button is held: the left stick both eyes or the left one, the right stick the
// right one. Nothing is said for a gamepad that has gone: the server holds the mirrors, then parks them.

import { driven, firstPad, FULL_DEG_S, FULL_V_S, reading } from "./sticks.js";
import { GAZE_MOST_DEG, pointOf, voltsOf } from "./words.js";

/**
 * @import { Commands, Point, Store } from "#console"
 * @import { Reading } from "./sticks.js"
 * @import { Place, Steering } from "./steering.js"
 * @typedef {{gaze: Point, left: Point, right: Point}} Aims
 */

const LOOK_MS = 500;
const LONGEST_S = 0.1; // a page that stood still for longer must not jump
const GONE =
  "It was disconnected while steering: the mirrors hold, and are parked after 3 s. Plug it in, and press again.";

/** The gamepad of one page. */
export class GamepadSteering {
  #store;
  #steering;
  #commands;
  #reads = false;
  #holds = false;
  /** Direction steered to by the sticks; null before the server has reported the mirrors' position. @type {Aims | null} */
  #aims = null;
  #last_ms = 0;

  /** @param {{store: Store, steering: Steering, commands: Commands}} context */
  constructor({ store, steering, commands }) {
    this.#store = store;
    this.#steering = steering;
    this.#commands = commands;
    setInterval(() => this.#look(), LOOK_MS);
  }

  #pad() {
    return document.hidden ? null : firstPad(navigator.getGamepads());
  }

  #look() {
    const there = this.#pad() !== null;
    const { gamepad } = this.#store.state;
    if (there && gamepad !== "there") this.#store.set({ gamepad: "there" });
    if (!there && gamepad === "there") this.#store.set({ gamepad: null });
    if (!there || this.#reads) return;
    this.#reads = true;
    requestAnimationFrame((now_ms) => this.#frame(now_ms));
  }

  /** @param {number} now_ms */
  #frame(now_ms) {
    const pad = this.#pad();
    const dt_s = Math.min(LONGEST_S, (now_ms - this.#last_ms) / 1000);
    this.#last_ms = now_ms;
    if (!pad) return this.#gone();
    const sticks = reading(pad);
    if (!sticks.held) this.#letGo();
    else this.#steer(sticks, dt_s);
    requestAnimationFrame((next_ms) => this.#frame(next_ms));
  }

  #gone() {
    this.#reads = false;
    if (!this.#holds) return;
    this.#holds = false;
    this.#steering.abandon();
    this.#store.set({ gamepad: "lost" });
    this.#commands.notify({ tone: "warn", title: "The gamepad has gone", detail: GONE });
  }

  #letGo() {
    if (!this.#holds) return;
    this.#holds = false;
    this.#steering.release();
  }

  /** @param {Reading} sticks @param {number} dt_s */
  #steer(sticks, dt_s) {
    if (!this.#holds) this.#aims = null;
    this.#holds = true;
    this.#aims ??= this.#begin();
    const moved = [sticks.left, sticks.right].some(({ x, y }) => x !== 0 || y !== 0);
    this.#steering.hold(this.#aims && moved ? this.#driven(this.#aims, sticks, dt_s) : {}, { alone: true });
  }

  /** Return the mirrors' position, null before the server has reported it. @returns {Aims | null} */
  #begin() {
    const { pose, gaze } = this.#store.state.steering ?? {};
    if (!pose || !this.#store.state.steer_limits) return null;
    return {
      gaze: { x: gaze?.ax_deg ?? 0, y: gaze?.ay_deg ?? 0 },
      left: pointOf(pose.left),
      right: pointOf(pose.right),
    };
  }

  /**
   * @param {Aims} aims
   * @param {Reading} sticks
   * @param {number} dt_s
   * @returns {Place}
   */
  #driven(aims, sticks, dt_s) {
    const { steer_split: split, steer_limits, rig } = this.#store.state;
    const volts = { speed: FULL_V_S, most: steer_limits?.max_v ?? 0, dt_s };
    if (!split && rig?.calibration) {
      aims.gaze = driven(aims.gaze, sticks.left, { speed: FULL_DEG_S, most: GAZE_MOST_DEG, dt_s });
      return { gaze: this.#steering.gazeAt({ ax_deg: aims.gaze.x, ay_deg: aims.gaze.y }) };
    }
    aims.left = driven(aims.left, sticks.left, volts);
    aims.right = split ? driven(aims.right, sticks.right, volts) : aims.left;
    return { volts: { left: voltsOf(aims.left), right: voltsOf(aims.right) } };
  }
}
