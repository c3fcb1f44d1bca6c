// Keeps the mosaic of one dataset equal to the server's while its page is open; follows the job that makes it.

import { Problem, request } from "../api.js";
import { QuietReads } from "../quiet.js";
import { capturePath } from "./dataset_orders.js";

/**
 * @typedef {import("../types.js").JobDocument} JobDocument
 * @typedef {import("../types.js").ProblemDocument} ProblemDocument
 * @typedef {import("../types.js").RigEvent} RigEvent
 * @typedef {import("./mosaic_documents.js").MosaicDocument} MosaicDocument
 */

/** Reads for one mosaic. */
export class MosaicReader {
  #id;
  #changed;
  #reads = new QuietReads();
  /** @type {MosaicDocument | null} */
  mosaic = null;
  /** Why the last making ended without a mosaic. @type {ProblemDocument | null} */
  trouble = null;
  /** Why there is no such dataset: the server's words. */
  missing = "";

  /**
   * @param {string} id
   * @param {() => void} changed
   */
  constructor(id, changed) {
    this.#id = id;
    this.#changed = changed;
  }

  readAll() {
    return this.#reads.read("mosaic", async () => {
      try {
        const mosaic = /** @type {MosaicDocument} */ (await request("GET", capturePath(this.#id, "/mosaic")));
        const ended = this.mosaic?.job_id && mosaic.job_id === null ? this.mosaic.job_id : null;
        if (ended !== null) await this.#readEnd(ended);
        Object.assign(this, { mosaic, missing: "" });
      } catch (error) {
        if (!(error instanceof Problem) || error.document.status !== 404) throw error;
        Object.assign(this, { mosaic: null, missing: error.message });
      }
      this.#changed();
    });
  }

  /** @param {MosaicDocument} mosaic as an order has answered */
  adopt(mosaic) {
    this.mosaic = mosaic;
    this.#changed();
  }

  /** Forget how the last making ended. */
  forget() {
    this.trouble = null;
    this.#changed();
  }

  /** @param {RigEvent} event */
  hear({ kind, data }) {
    if (data?.["capture_id"] === this.#id && /^(mosaic|capture)\./.test(kind)) return void this.readAll();
    const { mosaic } = this;
    if (kind !== "job.updated" || !mosaic?.job_id || data?.["id"] !== mosaic.job_id) return;
    const job = /** @type {JobDocument} */ (/** @type {unknown} */ (data));
    if (job.ended_utc !== null || job.progress === null) return void this.readAll();
    const { done, total, eta_s, note } = job.progress;
    this.adopt({ ...mosaic, progress: { done, total: total ?? 0, eta_s, note: note ?? "" } });
  }

  /** @param {string} job_id */
  async #readEnd(job_id) {
    const job = /** @type {JobDocument} */ (await request("GET", `/jobs/${job_id}`));
    this.trouble = job.state === "failed" ? job.problem : null;
  }
}
