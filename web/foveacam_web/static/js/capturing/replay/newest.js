// Loads the newest requested picture, one at a time, so that a slow line drops frames and does not fall behind.

/** Passes on the newest of what is wanted. */
export class Newest {
  #load;
  #shown = "";
  #next = "";
  #busy = false;

  /** @param {(what: string) => Promise<void>} load */
  constructor(load) {
    this.#load = load;
  }

  /** @param {string} what */
  async want(what) {
    this.#next = what;
    if (this.#busy) return;
    this.#busy = true;
    while (this.#shown !== this.#next) {
      this.#shown = this.#next;
      await this.#load(this.#shown);
    }
    this.#busy = false;
  }
}
