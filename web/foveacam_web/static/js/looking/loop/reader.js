// Keeps the vergence loop equal to the server's: four times a second while its page is shown and it runs, and at each
// event.

import { request } from "../../transport/api.js";
import { hasEnded } from "../../transport/jobs.js";
import { QuietReads } from "../../transport/quiet.js";
import { recent } from "./plots.js";
import { eventMessage } from "./words.js";

/**
 * @import { EventDocument, LoopDocument, LoopSample } from "#api"
 * @import { Commands, Store } from "#console"
 * @import { JobFollower } from "../../transport/jobs.js"
 */

const READ_MS = 250;
const HISTORY_EVERY = 2; // reads of the loop

/** The reads of the vergence loop of one page. */
export class LoopReader {
  #store;
  #commands;
  #reads = new QuietReads();
  #count = 0;
  /** @type {string | null} the run that the samples are of */
  #sampled = null;
  #tuning;

  /** @param {{store: Store, commands: Commands, tuning: JobFollower}} context */
  constructor({ store, commands, tuning }) {
    this.#store = store;
    this.#commands = commands;
    this.#tuning = tuning;
    store.on(["loop_page"], () => void this.readAll());
    store.on(["loop_tuning"], ({ loop_tuning: job }) => job && hasEnded(job.state) && void this.readAll());
    document.addEventListener("visibilitychange", () => void this.readAll());
    setInterval(() => this.#shows && store.state.loop?.running && void this.#readOn(), READ_MS);
  }

  get #shows() {
    const { loop_page, stream } = this.#store.state;
    return loop_page && stream === "open" && !document.hidden;
  }

  async readAll() {
    if (!this.#store.state.loop_page || document.hidden) return;
    await this.#readLoop();
    await this.#readHistory();
  }

  async #readOn() {
    this.#count += 1;
    await this.#readLoop();
    if (this.#count % HISTORY_EVERY === 0) await this.#readHistory();
  }

  #readLoop() {
    return this.#reads.read("loop", async () => {
      const loop = /** @type {LoopDocument} */ (await request("GET", "/loop"));
      this.#store.set({ loop });
      if (loop.tune_job_id === null || loop.tune_job_id === this.#tuning.id) return;
      this.#tuning.expect(loop.tune_job_id);
      await this.#tuning.readAll();
    });
  }

  #readHistory() {
    return this.#reads.read("history", async () => {
      const { loop } = this.#store.state;
      if (!loop?.running) return;
      const known = loop.job_id === this.#sampled ? this.#store.state.loop_samples : [];
      const after = known.at(-1)?.look ?? 0;
      const news = /** @type {LoopSample[]} */ (await request("GET", `/loop/history?after_look=${after}`));
      this.#sampled = loop.job_id;
      this.#store.set({ loop_samples: recent([...known, ...news]) });
    });
  }

  /** @param {EventDocument} event */
  onEvent(event) {
    this.#tuning.onEvent(event);
    if (!event.kind.startsWith("loop.")) return;
    void this.readAll();
    const message = eventMessage(event);
    if (message) this.#commands.notify(message);
  }
}
