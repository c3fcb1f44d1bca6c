// The position of a player in a recording, and how it advances. No DOM.

/** @import { TimelineDocument, TimelineStream } from "#api" */

export const SPEEDS = Object.freeze([0.25, 0.5, 1, 2, 4]);
const SAME_S = 0.001; // frames closer than this are one step

/** The clock of a player. */
export class PlayerClock {
  #streams;
  #stepped = "";
  #steps_s;
  #changed;
  #duration_s;
  at_s = 0;
  speed = 1;
  playing = false;

  /** @param {TimelineDocument} timeline @param {() => void} changed */
  constructor(timeline, changed) {
    this.#streams = timeline.streams;
    this.#steps_s = stepsOf(timeline.streams);
    this.#duration_s = timeline.duration_s;
    this.#changed = changed;
  }

  get duration_s() {
    return this.#duration_s;
  }

  get steps() {
    return this.#steps_s.length;
  }

  /** The index of the newest step, from 0. */
  get step() {
    return Math.max(0, upTo(this.#steps_s, this.at_s + SAME_S / 2) - 1);
  }

  /** Step through the frames of one stream, or of all. @param {string} name of the stream; empty for all */
  stepThrough(name) {
    if (name === this.#stepped) return;
    this.#stepped = name;
    this.#steps_s = stepsOf(this.#streams.filter((stream) => name === "" || stream.name === name));
  }

  /** @param {number} at_s */
  seek(at_s) {
    this.at_s = Math.min(Math.max(at_s, 0), this.#duration_s);
    this.#changed();
  }

  /** @param {number} steps forwards, or backwards when negative */
  go(steps) {
    this.playing = false;
    this.seek(this.#steps_s[Math.min(Math.max(this.step + steps, 0), this.#steps_s.length - 1)] ?? 0);
  }

  toggle() {
    if (!this.playing && this.at_s >= this.#duration_s) this.at_s = 0;
    this.playing = !this.playing;
    this.#changed();
  }

  /** @param {number} speed */
  setSpeed(speed) {
    this.speed = speed;
    this.#changed();
  }

  /** @param {number} by places in the list of speeds */
  shiftSpeed(by) {
    const index = SPEEDS.indexOf(this.speed) + by;
    this.setSpeed(SPEEDS[Math.min(Math.max(index, 0), SPEEDS.length - 1)] ?? 1);
  }

  /** Advance by a span of real time. @param {number} real_s */
  pass(real_s) {
    if (!this.playing) return;
    const to_s = this.at_s + this.speed * real_s;
    if (to_s >= this.#duration_s) this.playing = false;
    this.seek(to_s);
  }
}

/** Return the index of the newest frame of a camera at a moment. @param {TimelineStream} stream @param {number} at_s */
export function frameAt({ t_s }, at_s) {
  return Math.max(0, upTo(t_s, at_s + SAME_S / 2) - 1);
}

/** @param {TimelineStream[]} streams */
function stepsOf(streams) {
  const all = streams.flatMap(({ t_s }) => t_s).sort((a, b) => a - b);
  return all.filter((t_s, index) => index === 0 || t_s - /** @type {number} */ (all[index - 1]) > SAME_S);
}

/**
 * Return how many of the ascending moments are not after this one.
 * @param {readonly number[]} moments
 * @param {number} at_s
 */
function upTo(moments, at_s) {
  let [low, high] = [0, moments.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if (/** @type {number} */ (moments[middle]) <= at_s) low = middle + 1;
    else high = middle;
  }
  return low;
}
