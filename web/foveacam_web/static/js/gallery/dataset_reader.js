// Keeps one dataset and its points equal to the server's while its page is open.

import { RequestError, request } from "../api.js";
import { QuietReads } from "../quiet.js";
import { capturePath } from "./dataset_orders.js";
import { withProgress } from "./datasets_reader.js";

/** @import { CaptureDocument, EventDocument, PointsDocument } from "#api" */

const GROWING_MS = 10_000; // interval of redrawing the pictures of a running capture: drawing costs the server time

/** The reads of one dataset. */
export class DatasetReader {
  #id;
  #changed;
  #reads = new QuietReads();
  #due_ms = 0;
  /** @type {CaptureDocument | null} */
  dataset = null;
  /** @type {PointsDocument | null} */
  points = null;
  /** The server's reason when the dataset does not exist. */
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
    this.#due_ms = performance.now() + GROWING_MS;
    return this.#reads.read("dataset", async () => {
      try {
        const dataset = /** @type {CaptureDocument} */ (await request("GET", capturePath(this.#id)));
        const readable = dataset.state !== "damaged" && dataset.points.planned > 0;
        const points = readable
          ? /** @type {PointsDocument} */ (await request("GET", capturePath(this.#id, "/points")))
          : null;
        Object.assign(this, { dataset, points, missing: "" });
      } catch (error) {
        if (!(error instanceof RequestError) || error.document.status !== 404) throw error;
        Object.assign(this, { dataset: null, points: null, missing: error.message });
      }
      this.#changed();
    });
  }

  /** @param {CaptureDocument} dataset the response to a command */
  adopt(dataset) {
    this.dataset = dataset;
    this.#changed();
  }

  /** @param {EventDocument} event */
  hear({ kind, data }) {
    if (data?.["capture_id"] !== this.#id) return;
    if (kind !== "capture.progress") return void (kind.startsWith("capture.") && this.readAll());
    const news = /** @type {any} */ (data); // any: the data of this event kind, which OpenAPI leaves open
    const { dataset } = this;
    if (
      !dataset ||
      dataset.state !== news.state ||
      dataset.progress?.phase !== news.phase ||
      performance.now() > this.#due_ms
    )
      void this.readAll();
    if (dataset) this.adopt(withProgress(dataset, news));
  }
}
