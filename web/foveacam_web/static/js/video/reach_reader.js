// Reads the reach of each eye: for targets far away at first, then for the last measured distance.

import { request } from "../transport/api.js";
import { answerOf } from "../looking/answers.js";
import { QuietReads } from "../transport/quiet.js";

/**
 * @import { ReachDocument } from "#api"
 * @import { Store } from "#console"
 */

const AFTER_ANSWER_MS = 400; // the fixation's answer is drawn first
const STEP_PER_M = 0.02; // 1/m: moves an outline by 3 wide pixels

/** Keeps `store.state.reach` equal to the server's. */
export class ReachReader {
  #store;
  #reads = new QuietReads();
  #asked = "";
  /** @type {number | null} */
  #distance_m = null;

  /** @param {Store} store */
  constructor(store) {
    this.#store = store;
    store.on(["rig", "current"], () => this.#follow());
  }

  #follow() {
    const { rig, current } = this.#store.state;
    const answer = current?.fixation ? answerOf(current.fixation) : null;
    if (answer?.distance_m)
      this.#distance_m = 1 / (STEP_PER_M * Math.max(1, Math.round(1 / answer.distance_m / STEP_PER_M)));
    const calibration = rig?.calibration?.id ?? "";
    const wanted = `${calibration} ${this.#distance_m}`;
    if (wanted === this.#asked) return;
    this.#asked = wanted;
    if (!calibration) this.#store.set({ reach: null });
    else setTimeout(() => void this.#read(), this.#store.state.reach ? AFTER_ANSWER_MS : 0);
  }

  #read() {
    return this.#reads.read("reach", async () => {
      const at = this.#distance_m === null ? "" : `?distance_m=${this.#distance_m.toFixed(3)}`;
      this.#store.set({ reach: /** @type {ReachDocument} */ (await request("GET", `/reach${at}`)) });
    });
  }
}
