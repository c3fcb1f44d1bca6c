// Rows that a part of the page reads from the server, with the last refusal and its row.

import { outcome, request } from "../../transport/api.js";
import { QuietReads } from "../../transport/quiet.js";

/** @import { Problem } from "#api" */

/** A list of the server. @template T */
export class Listing {
  /** @type {T[] | null} */
  rows = null;
  /** Why it cannot be read. @type {Problem | null} */
  fault = null;
  /** `at`: the row it is about. @type {{at: string, problem: Problem} | null} */
  refused = null;
  /** Called when something of it has changed. */
  changed = () => {};
  #reads = new QuietReads();
  #path;
  #rowsOf;

  /** @param {string} path below /api/v1 @param {(answer: any) => T[]} rowsOf any: an answer of that path */
  constructor(path, rowsOf) {
    this.#path = path;
    this.#rowsOf = rowsOf;
  }

  read() {
    return this.#reads.read("rows", async () => {
      const { answer, error } = await outcome(request("GET", this.#path));
      if (!error) [this.rows, this.fault] = [this.#rowsOf(answer), null];
      else if (error.document.status > 0) this.fault = error.document; // a lost server is told elsewhere
      this.changed();
    });
  }

  /**
   * Send an order about a row and read the list again; return the answer, null where it was refused.
   * @template A
   * @param {string} at the row
   * @param {"POST" | "PATCH" | "DELETE"} method
   * @param {string} path
   * @param {object} [body]
   * @returns {Promise<A | true | null>} true where the answer has no body
   */
  async order(at, method, path, body) {
    const { answer, error } = await outcome(/** @type {Promise<A | null>} */ (request(method, path, { body })));
    this.refused = error && { at, problem: error.document };
    await this.read();
    return error ? null : (answer ?? true);
  }
}
