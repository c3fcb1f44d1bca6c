// Reads something from the server once at a time; asked for again meanwhile, once more after.

import { RequestError } from "./api.js";

/** The reads of one page, by name. */
export class QuietReads {
  #busy = new Set();

  /**
   * Read; a failure is left to the next try: the banner says that the server is away, each panel says what it lacks.
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
        await read();
      } while (this.#busy.has(`${what} again`));
    } catch (error) {
      if (!(error instanceof RequestError)) throw error;
    } finally {
      this.#busy.delete(what);
      this.#busy.delete(`${what} again`);
    }
  }
}
