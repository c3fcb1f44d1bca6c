// Serialises reads from the server: one at a time by name; a read requested meanwhile runs once more afterwards.

import { outcome, request } from "./api.js";

/**
 * @import { ConsoleState, Store } from "#console"
 */

const FIRST_PAUSE_MS = 2000;
const LAST_PAUSE_MS = 30_000;
const NOT_YET = 503; // the rig opens, or all places are taken

/** The reads of one page by name. */
export class QuietReads {
  #busy = new Set();
  /** @type {Map<string, {timer: ReturnType<typeof setTimeout>, pause_ms: number}>} reads that the server put off */
  #put_off = new Map();
  /** @type {Map<string, ReturnType<typeof setTimeout>>} the next of the reads that are repeated */
  #repeated = new Map();

  /**
   * Run a read. A failed request is ignored until the next read: the banner and the panels show what is missing. One
   * that the server can answer later is read again by itself.
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
        await this.#once(what, read);
      } while (this.#busy.has(`${what} again`));
    } finally {
      this.#busy.delete(what);
      this.#busy.delete(`${what} again`);
    }
  }

  /**
   * Read a document of the server into the page's state.
   * @template {keyof ConsoleState} K
   * @param {Store} store
   * @param {K} key
   * @param {string} path
   * @param {(found: any) => ConsoleState[K]} [shown] `any`: what the path answers
   */
  keep(store, key, path, shown = (found) => found) {
    return this.read(key, async () => {
      store.set(/** @type {Partial<ConsoleState>} */ ({ [key]: shown(await request("GET", path)) }));
    });
  }

  /**
   * Read now and repeatedly.
   * @param {string} what
   * @param {() => Promise<void>} read
   * @param {() => number | null} pause_ms called after each read: the pause before the next one, null for none
   */
  repeat(what, read, pause_ms) {
    clearTimeout(this.#repeated.get(what));
    return this.read(what, read).finally(() => {
      clearTimeout(this.#repeated.get(what));
      const pause = pause_ms();
      if (pause !== null)
        this.#repeated.set(
          what,
          setTimeout(() => void this.repeat(what, read, pause_ms), pause),
        );
    });
  }

  /** @param {string} what @param {() => Promise<void>} read */
  async #once(what, read) {
    const before = this.#put_off.get(what);
    clearTimeout(before?.timer);
    this.#put_off.delete(what);
    const { error } = await outcome(read());
    if (error?.document.status !== NOT_YET) return;
    const pause_ms = before ? Math.min(LAST_PAUSE_MS, 2 * before.pause_ms) : FIRST_PAUSE_MS;
    this.#put_off.set(what, { timer: setTimeout(() => void this.read(what, read), pause_ms), pause_ms });
  }
}

/** Sort documents, the newest first. @template {{created_utc: string}} T @param {T[]} documents */
export function newestFirst(documents) {
  return documents.sort((a, b) => b.created_utc.localeCompare(a.created_utc));
}
