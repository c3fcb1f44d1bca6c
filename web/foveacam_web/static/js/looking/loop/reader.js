// Keeps the vergence loop equal to the server's: four times a second while its page is shown and it runs, and at each
// event.

import { request } from "../../transport/api.js";
import { hasEnded, JobWatch } from "../../transport/jobs.js";
import { QuietReads } from "../../transport/quiet.js";
import { recent } from "./plots.js";
import { eventMessage } from "./words.js";

/**
 * @import { EventDocument, JobDocument, LoopDocument, LoopSample } from "#api"
 * @import { Commands } from "../../commands.js"
 * @import { Store } from "../../store.js"
 */

const READ_MS = 250;
const HISTORY_EVERY = 2; // reads of the loop
const JOB_MS = 700;

/** The reads of the vergence loop of one page. */
export class LoopReader {
  #store;
  #commands;
  #reads = new QuietReads();
  #count = 0;
  /** @type {string | null} the run that the samples are of */
  #sampled = null;
  #watch = new JobWatch({
    every_ms: JOB_MS,
    found: (job) => this.#store.set({ loop_tuning: job }),
    lost: () => this.#store.set({ loop_tuning: null }),
  });

  /** @param {{store: Store, commands: Commands}} context */
  constructor({ store, commands }) {
    this.#store = store;
    this.#commands = commands;
    store.on(["loop_page"], () => void this.readAll());
    store.on(["loop_tuning"], ({ loop_tuning }) => this.#follow(loop_tuning));
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
      const known = this.#store.state.loop_tuning;
      if (loop.tune_job_id !== null && loop.tune_job_id !== known?.id)
        this.#store.set({
          loop_tuning: /** @type {JobDocument} */ (await request("GET", `/jobs/${loop.tune_job_id}`)),
        });
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

  /** Read the job of a tuning until it has ended, then what it found. @param {JobDocument | null} job */
  #follow(job) {
    if (job === null) this.#watch.stop();
    else if (!hasEnded(job.state)) this.#watch.watch(job.id);
    else {
      this.#watch.stop();
      void this.readAll();
    }
  }

  /** @param {EventDocument} event */
  hear(event) {
    if (!event.kind.startsWith("loop.")) return;
    void this.readAll();
    const message = eventMessage(event);
    if (message) this.#commands.say(message);
  }
}
