// Repeats a request while its input changes: one at a time, and of the inputs that come meanwhile only the newest.

import { outcome, request } from "../../transport/api.js";

/**
 * @template T
 * @typedef {import("#page").Answered<T>} Answered
 */

const PATIENCE_MS = 60_000;

/**
 * A request that is repeated with changing input.
 * @template T
 */
export class Newest {
  #path;
  #onAnswer;
  /** @type {unknown} */
  #due = null;
  #asking = false;
  /** @type {string} */
  #asked = "";
  /** @type {Answered<T>} */
  #answer = { stale: false, document: null, problem: null };

  /** @param {string} path below /api/v1 @param {() => void} onAnswer called at each new answer */
  constructor(path, onAnswer) {
    this.#path = path;
    this.#onAnswer = onAnswer;
  }

  get answer() {
    return this.#answer;
  }

  /**
   * Request an answer for this input, unless it is the last one's; null: there is no valid input, and the answer is
   * cleared.
   * @param {object | null} body
   */
  want(body) {
    const text = JSON.stringify(body);
    if (text === this.#asked) return;
    this.#asked = text;
    this.#due = body;
    if (body !== null) this.#set({ ...this.#answer, stale: true });
    else this.#set({ stale: false, document: null, problem: null });
    if (!this.#asking) void this.#ask();
  }

  /** Repeat the last request if the server was away. */
  again() {
    if (this.#answer.problem?.status !== 0) return;
    const body = JSON.parse(this.#asked);
    this.#asked = "";
    this.want(body);
  }

  async #ask() {
    this.#asking = true;
    try {
      while (this.#due !== null) {
        const body = this.#due;
        this.#due = null;
        const found = await this.#send(body);
        if (this.#asked !== "null") this.#set({ stale: this.#due !== null, ...found });
      }
    } finally {
      this.#asking = false;
    }
  }

  /**
   * @param {unknown} body
   * @returns {Promise<Pick<Answered<T>, "document" | "problem">>} after a refusal, the document before it
   */
  async #send(body) {
    const options = { body, patience_ms: PATIENCE_MS };
    const { answer, error } = await outcome(/** @type {Promise<T>} */ (request("POST", this.#path, options)));
    return { document: error ? this.#answer.document : answer, problem: error?.document ?? null };
  }

  /** @param {Answered<T>} answer */
  #set(answer) {
    this.#answer = answer;
    this.#onAnswer();
  }
}
