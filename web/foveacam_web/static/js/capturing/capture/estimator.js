// Requests estimates while the plan is edited: shortly after the last key, one at a time; only the newest answer
// counts.

import { outcome, request } from "../../transport/api.js";

/**
 * @import { EstimateRequest } from "#api"
 * @import { Estimate, Store } from "#console"
 * @typedef {import("#page").Answered<Estimate>} Answered
 */

const REST_MS = 250; // from the last key to the request
const PATIENCE_MS = 60_000; // ten thousand points take long

/** The estimate requests of one page. */
export class Estimator {
  #store;
  /** @type {EstimateRequest | null} */
  #wanted = null;
  /** @type {EstimateRequest | null} */
  #due = null;
  #asking = false;
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  #timer;

  /** @param {Store} store */
  constructor(store) {
    this.#store = store;
  }

  /** Set the plan to estimate; null while it is incomplete. @param {EstimateRequest | null} wish */
  want(wish) {
    if (JSON.stringify(wish) === JSON.stringify(this.#wanted)) return;
    this.#wanted = wish;
    clearTimeout(this.#timer);
    if (wish === null) this.#publish({ stale: false, problem: null, document: null });
    else this.#soon(wish);
  }

  /** Repeat the request: the rig, its calibration or the disk has changed. */
  again() {
    if (this.#wanted) this.#soon(this.#wanted);
  }

  /** @param {EstimateRequest} wish */
  #soon(wish) {
    this.#publish({ ...this.#store.state.estimate, stale: true });
    clearTimeout(this.#timer);
    this.#timer = setTimeout(() => {
      this.#due = wish;
      if (!this.#asking) void this.#ask();
    }, REST_MS);
  }

  async #ask() {
    this.#asking = true;
    while (this.#due) {
      const wish = this.#due;
      this.#due = null;
      const answer = await answerTo(wish);
      if (wish === this.#wanted && !this.#due) this.#publish({ stale: false, ...answer });
    }
    this.#asking = false;
  }

  /** @param {Answered} estimate */
  #publish(estimate) {
    this.#store.set({ estimate });
  }
}

/** @param {EstimateRequest} body @returns {Promise<Omit<Answered, "stale">>} */
async function answerTo(body) {
  const options = { body, patience_ms: PATIENCE_MS };
  const asked = /** @type {Promise<Estimate>} */ (request("POST", "/captures/estimates", options));
  const { answer, error } = await outcome(asked);
  return { document: answer, problem: error?.document ?? null };
}
