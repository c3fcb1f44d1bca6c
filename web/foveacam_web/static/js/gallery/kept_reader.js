// Keeps the list and the trash of one resource equal to the server's while they are shown.

import { request } from "../api.js";
import { QuietReads } from "../quiet.js";

/** @import { EventDocument } from "#api" */

/**
 * The reads of one list and its trash.
 * @template {{id: string}} T
 */
export class KeptReader {
  #resource;
  #changed;
  #hear;
  #reads = new QuietReads();
  #text = "";
  /** The changes by events while the list was being read, which may be older. @type {Map<string, (known: T) => T>} */
  #meanwhile = new Map();
  /** @type {T[] | null} */
  list = null;
  /** @type {T[] | null} */
  trash = null;
  /** The search text of the list as it was read. */
  searched = "";

  /**
   * @param {{resource: string, changed: () => void, hear: (reader: KeptReader<T>, event: EventDocument) => void}} context
   *   `resource`: its path below /api/v1; `hear`: applies an event
   */
  constructor({ resource, changed, hear }) {
    this.#resource = resource;
    this.#changed = changed;
    this.#hear = hear;
  }

  readAll() {
    return Promise.all([this.readList(), this.#readTrash()]);
  }

  /**
   * Search for the entries that contain every word.
   * @param {string} text
   */
  search(text) {
    this.#text = text;
    return this.readList();
  }

  /**
   * Change one entry without reading the list.
   * @param {string} id
   * @param {(known: T) => T} change
   */
  change(id, change) {
    this.#meanwhile.set(id, change);
    if (!this.list?.some((each) => each.id === id)) return;
    this.list = this.list.map((each) => (each.id === id ? change(each) : each));
    this.#changed();
  }

  readList() {
    return this.#reads.read("list", async () => {
      const text = this.#text;
      this.#meanwhile.clear();
      const list = await this.#read(`text=${encodeURIComponent(text)}`);
      this.list = list.map((each) => this.#meanwhile.get(each.id)?.(each) ?? each);
      this.searched = text.trim();
      this.#changed();
    });
  }

  #readTrash() {
    return this.#reads.read("trash", async () => {
      this.trash = await this.#read("removed=true");
      this.#changed();
    });
  }

  /**
   * @param {string} query
   * @returns {Promise<T[]>}
   */
  #read(query) {
    return request("GET", `${this.#resource}?${query}`);
  }

  /** @param {EventDocument} event */
  hear(event) {
    this.#hear(this, event);
  }
}
