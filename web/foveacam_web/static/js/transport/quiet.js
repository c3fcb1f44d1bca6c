// Serialises reads from the server: one at a time by name; a read requested meanwhile runs once more afterwards.

import { RequestError } from "./api.js";

/** The reads of one page by name. */
export class QuietReads {
  #busy = new Set();

  /**
   * Run a read. A failed request is ignored until the next read: the banner and the panels show what is missing.
   * @param {string} what
   * @param {() => Promise<void>} read
   */
  async read(what, read) {
    if (this.#busy.has(what)) {
      this.#busy.add(`${what} again`);
      return;
    }
    this.#busy.add(what);
    try {
      do {
        this.#busy.delete(`${what} again`);
        await read().catch((error) => {
          if (!(error instanceof RequestError)) throw error;
        });
      } while (this.#busy.has(`${what} again`));
    } finally {
      this.#busy.delete(what);
      this.#busy.delete(`${what} again`);
    }
  }
}
