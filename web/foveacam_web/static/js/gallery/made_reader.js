// Keeps a dataset's mosaic or reference equal to the server's while its page is open, and follows the job that makes
// it.

import { RequestError, request } from "../api.js";
import { QuietReads } from "../quiet.js";
import { capturePath } from "./dataset_orders.js";

/**
 * @import { EventDocument, JobDocument, Problem } from "#api"
 * @import { MakingDocument } from "#page"
 */

/**
 * The reads of one mosaic or reference.
 * @template {MakingDocument} T
 */
export class MadeReader {
  #id;
  #kind;
  #changed;
  #reads = new QuietReads();
  /** @type {T | null} */
  document = null;
  /** The problem of the last attempt to make it. @type {Problem | null} */
  trouble = null;
  /** The server's reason when the dataset does not exist. */
  missing = "";

  /**
   * @param {string} id of the dataset
   * @param {"mosaic" | "reference"} kind
   * @param {() => void} changed
   */
  constructor(id, kind, changed) {
    this.#id = id;
    this.#kind = kind;
    this.#changed = changed;
  }

  readAll() {
    return this.#reads.read(this.#kind, async () => {
      try {
        const document = /** @type {T} */ (await request("GET", capturePath(this.#id, `/${this.#kind}`)));
        const ended = this.document?.job_id && document.job_id === null ? this.document.job_id : null;
        if (ended !== null) await this.#readEnd(ended);
        Object.assign(this, { document, missing: "" });
      } catch (error) {
        if (!(error instanceof RequestError) || error.document.status !== 404) throw error;
        Object.assign(this, { document: null, missing: error.message });
      }
      this.#changed();
    });
  }

  /** @param {T} document the response to a command */
  adopt(document) {
    this.document = document;
    this.#changed();
  }

  /** Clear the problem of the last attempt. */
  forget() {
    this.trouble = null;
    this.#changed();
  }

  /** @param {EventDocument} event */
  hear({ kind, data }) {
    const [of, what] = kind.split(".");
    if (data?.["capture_id"] === this.#id && (of === this.#kind || (of === "capture" && what !== "progress")))
      return void this.readAll();
    const { document } = this;
    if (kind !== "job.updated" || !document?.job_id || data?.["id"] !== document.job_id) return;
    const job = /** @type {JobDocument} */ (/** @type {unknown} */ (data));
    if (job.ended_utc !== null || job.progress === null) return void this.readAll();
    const { done, total, eta_s, note } = job.progress;
    this.adopt({ ...document, progress: { done, total: total ?? 0, eta_s, note: note ?? "" } });
  }

  /** @param {string} job_id */
  async #readEnd(job_id) {
    const job = /** @type {JobDocument} */ (await request("GET", `/jobs/${job_id}`));
    this.trouble = job.state === "failed" ? job.problem : null;
  }
}
