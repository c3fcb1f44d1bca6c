// Keeps the list of stills and their trash equal to the server's while they are shown.

import { request } from "../api.js";
import { QuietReads } from "../quiet.js";

/** @import { EventDocument, StillDocument } from "#api" */

/** The reads of the list and the trash. */
export class StillsReader {
  #changed;
  #reads = new QuietReads();
  #text = "";
  /** @type {StillDocument[] | null} */
  list = null;
  /** @type {StillDocument[] | null} */
  trash = null;
  /** The stills neither kept nor discarded. */
  waiting = 0;
  /** The search text of the list as it was read. */
  searched = "";

  /** @param {() => void} changed */
  constructor(changed) {
    this.#changed = changed;
  }

  readAll() {
    return this.#reads.read("stills", async () => {
      const text = this.#text;
      const of = (/** @type {string} */ query) =>
        /** @type {Promise<StillDocument[]>} */ (request("GET", `/stills?${query}`));
      const [list, trash, held] = await Promise.all([
        of(`text=${encodeURIComponent(text)}`),
        of("state=removed"),
        of("state=held"),
      ]);
      Object.assign(this, { list, trash, waiting: held.length, searched: text.trim() });
      this.#changed();
    });
  }

  /** @param {string} text words that all must hold */
  search(text) {
    this.#text = text;
    return this.readAll();
  }

  /** @param {EventDocument} event */
  hear({ kind }) {
    if (kind.startsWith("still.")) void this.readAll();
  }
}
