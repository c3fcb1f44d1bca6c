// Follows the still that is being taken, and reads the stills that wait to be kept or discarded.

import { request } from "../../transport/api.js";
import { JobWatch } from "../../transport/jobs.js";
import { QuietReads } from "../../transport/quiet.js";

/**
 * @import { EventDocument, JobDocument, StillDocument } from "#api"
 * @import { StillPress } from "#page"
 */

const LOOK_MS = 500; // interval of reading the job, in case its events do not arrive

/** The still reads of one page. */
export class StillReader {
  #reads = new QuietReads();
  #watch = new JobWatch({
    every_ms: LOOK_MS,
    found: (job) => this.#take(job),
    lost: ({ status }) => this.#lost(status),
  });
  /** @type {StillPress | null} */
  press = null;
  /** The stills neither kept nor discarded, newest first; null before the first read. @type {StillDocument[] | null} */
  held = null;
  /** Called when the shown state has changed. */
  changed = () => {};
  /** Called with each still that was taken. @type {(still: StillDocument) => void} */
  taken = () => {};

  async readAll() {
    await Promise.all([this.readHeld(), this.#reads.read("press", () => this.#find())]);
  }

  readHeld() {
    return this.#reads.read("held", async () => {
      this.held = /** @type {StillDocument[]} */ (await request("GET", "/stills?state=held"));
      this.changed();
    });
  }

  /** Follow the job of a still. @param {JobDocument} job */
  follow(job) {
    this.press = { job_id: job.id, over: false, done: 0, total: null, problem: null };
    this.#take(job);
  }

  /** Clear the result of the last still. */
  dismiss() {
    if (!this.press?.over) return;
    this.press = null;
    this.changed();
  }

  /** @param {EventDocument} event */
  hear({ kind, data }) {
    if (kind.startsWith("still.")) void this.readHeld();
    if (kind !== "job.updated") return;
    const job = /** @type {JobDocument} */ (data?.["job"] ?? data);
    if (job.kind !== "still") return;
    if (this.press?.job_id === job.id) this.#take(job);
    else if (job.ended_utc === null && (this.press === null || this.press.over)) this.follow(job);
  }

  /** Read which still is being taken, after the page has opened or the server has come back. */
  async #find() {
    if (this.press && !this.press.over) return this.#watch.read(this.press.job_id);
    const jobs = /** @type {JobDocument[]} */ (await request("GET", "/jobs?limit=20"));
    const job = jobs.find(({ kind, ended_utc }) => kind === "still" && ended_utc === null);
    if (job) this.follow(job);
  }

  /** @param {number} status of the refusal; 404: the server has another data directory, without this job */
  #lost(status) {
    if (status === 404) this.press = null;
    else if (this.press) this.#watch.watch(this.press.job_id);
    this.changed();
  }

  /** @param {JobDocument} job */
  #take(job) {
    if (this.press?.job_id !== job.id || this.press.over) return;
    const { done = 0, total = null } = job.progress ?? {};
    const over = job.ended_utc !== null;
    this.press = { job_id: job.id, over, done, total, problem: job.problem };
    this.changed();
    if (!over) return this.#watch.watch(job.id);
    this.#watch.stop();
    void this.readHeld();
    if (job.state === "succeeded" && job.result_url)
      void this.#reads.read("taken", () => this.#tellTaken(job.result_url ?? ""));
  }

  /** @param {string} url */
  async #tellTaken(url) {
    this.taken(/** @type {StillDocument} */ (await request("GET", url.replace(/^.*\/api\/v1/, ""))));
  }
}
