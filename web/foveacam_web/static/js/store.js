// Holds the page's state and notifies listeners by key, once a turn however many changes there were.

/** @import { ConsoleState } from "#page" */

/** State with listeners by key. */
export class Store {
  /** @type {ConsoleState} */
  #state;
  /** @type {{keys: Set<keyof ConsoleState>, listener: (state: ConsoleState) => void}[]} */
  #listeners = [];
  /** @type {Set<keyof ConsoleState>} */
  #changed = new Set();

  /** @param {ConsoleState} state */
  constructor(state) {
    this.#state = state;
  }

  get state() {
    return this.#state;
  }

  /** @param {Partial<ConsoleState>} part */
  set(part) {
    this.#state = { ...this.#state, ...part };
    if (this.#changed.size === 0) queueMicrotask(() => this.#notify());
    for (const key of /** @type {(keyof ConsoleState)[]} */ (Object.keys(part))) this.#changed.add(key);
  }

  /**
   * Call the listener now and whenever one of the keys changes, until the signal is aborted, if there is one.
   * @param {(keyof ConsoleState)[]} keys
   * @param {(state: ConsoleState) => void} listener
   * @param {AbortSignal} [signal]
   */
  on(keys, listener, signal) {
    const entry = { keys: new Set(keys), listener };
    this.#listeners.push(entry);
    signal?.addEventListener("abort", () => (this.#listeners = this.#listeners.filter((each) => each !== entry)));
    listener(this.#state);
  }

  /**
   * Resolve with the state once it satisfies the test.
   * @param {(keyof ConsoleState)[]} keys
   * @param {(state: ConsoleState) => boolean} test
   * @returns {Promise<ConsoleState>}
   */
  until(keys, test) {
    return new Promise((resolve) => {
      /** @param {ConsoleState} state */
      const listener = (state) => {
        if (!test(state)) return;
        this.#listeners = this.#listeners.filter((entry) => entry.listener !== listener);
        resolve(state);
      };
      this.on(keys, listener);
    });
  }

  #notify() {
    const changed = this.#changed;
    this.#changed = new Set();
    for (const entry of [...this.#listeners]) {
      const listens = this.#listeners.includes(entry); // an earlier listener may have removed it
      if (listens && [...entry.keys].some((key) => changed.has(key))) entry.listener(this.#state);
    }
  }
}
