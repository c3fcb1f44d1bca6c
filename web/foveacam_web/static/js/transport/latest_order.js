// Sends orders that come faster than they can be obeyed: one at a time, and of those that come meanwhile only the newest.

/**
 * Orders of one kind.
 * @template T
 */
export class LatestOrder {
  #send;
  #pause_ms;
  /** @type {T | null} */
  #next = null;
  /** @type {Promise<void> | null} */
  #going = null;

  /** @param {{send: (order: T) => Promise<unknown>, pause_ms: number}} options `send`: resolves with null when it was refused */
  constructor({ send, pause_ms }) {
    this.#send = send;
    this.#pause_ms = pause_ms;
  }

  get busy() {
    return this.#going !== null;
  }

  /** @param {T} order */
  give(order) {
    this.#next = order;
    this.#going ??= this.#go().finally(() => (this.#going = null));
  }

  /** Drop the order that waits, and resolve when the one on its way has been obeyed. */
  async drop() {
    this.#next = null;
    await this.#going;
  }

  async #go() {
    while (this.#next !== null) {
      const order = this.#next;
      this.#next = null;
      const pause = new Promise((resolve) => setTimeout(resolve, this.#pause_ms));
      if ((await this.#send(order)) === null) this.#next = null; // one message for a refused drag, not twenty a second
      await pause;
    }
  }
}
