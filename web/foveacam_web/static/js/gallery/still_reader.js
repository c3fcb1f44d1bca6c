// Keeps one still equal to the server's while its page is open.

import { RequestError, request } from "../api.js";
import { stillPath } from "../capture/still_orders.js";
import { QuietReads } from "../quiet.js";

/** @import { EventDocument, StillDocument } from "#api" */

/** The reads of one still. */
export class OneStillReader {
  #id;
  #changed;
  #reads = new QuietReads();
  /** @type {StillDocument | null} */
  still = null;
  /** The server's reason when the still does not exist. */
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
    return this.#reads.read("still", async () => {
      try {
        this.adopt(/** @type {StillDocument} */ (await request("GET", stillPath(this.#id))));
      } catch (error) {
        if (!(error instanceof RequestError) || error.document.status !== 404) throw error;
        Object.assign(this, { still: null, missing: error.message });
        this.#changed();
      }
    });
  }

  /** @param {StillDocument} still the response to a command */
  adopt(still) {
    Object.assign(this, { still, missing: "" });
    this.#changed();
  }

  /** @param {EventDocument} event */
  hear({ kind, data }) {
    if (kind.startsWith("still.") && data?.["still_id"] === this.#id) void this.readAll();
  }
}
