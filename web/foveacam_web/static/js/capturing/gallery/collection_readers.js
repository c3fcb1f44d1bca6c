// Keeps the list and the trash of a collection, or one of its entries, equal to the server's while they are shown.

import { RequestError, request } from "../../transport/api.js";
import { QuietReads } from "../../transport/quiet.js";

/** @import { EventDocument } from "#api" */

/**
 * The reads of one list and its trash.
 * @template {{id: string}} T
 */
export class ListReader {
  #resource;
  #trash_query;
  #waiting_query;
  #onEvent;
  #reads = new QuietReads();
  #text = "";
  /** The changes by events while the list was being read, which may be older. @type {Map<string, (known: T) => T>} */
  #meanwhile = new Map();
  /** Called when something has changed. */
  changed = () => {};
  /** @type {T[] | null} */
  list = null;
  /** @type {T[] | null} */
  trash = null;
  /** The number of entries of the waiting query. */
  waiting = 0;
  /** The search text of the list as it was read. */
  searched = "";

  /**
   * @param {{resource: string, trash_query?: string, waiting_query?: string, onEvent: (reader: ListReader<T>, event: EventDocument) => void}} context
   *   `resource`: its path below /api/v1; `waiting_query`: selects the entries of which only the number is shown;
   *   `onEvent`: applies an event
   */
  constructor({ resource, trash_query = "removed=true", waiting_query = "", onEvent }) {
    this.#resource = resource;
    this.#trash_query = trash_query;
    this.#waiting_query = waiting_query;
    this.#onEvent = onEvent;
  }

  readAll() {
    return Promise.all([
      this.readList(),
      this.#read("trash", this.#trash_query, (trash) => (this.trash = trash)),
      this.#waiting_query && this.#read("waiting", this.#waiting_query, ({ length }) => (this.waiting = length)),
    ]);
  }

  /** Search for the entries that contain every word. @param {string} text */
  search(text) {
    this.#text = text;
    return this.readList();
  }

  /** Change one entry without reading the list. @param {string} id @param {(known: T) => T} change */
  change(id, change) {
    this.#meanwhile.set(id, change);
    if (!this.list?.some((each) => each.id === id)) return;
    this.list = this.list.map((each) => (each.id === id ? change(each) : each));
    this.changed();
  }

  readList() {
    return this.#reads.read("list", async () => {
      const text = this.#text;
      this.#meanwhile.clear();
      const list = /** @type {T[]} */ (await request("GET", `${this.#resource}?text=${encodeURIComponent(text)}`));
      this.list = list.map((each) => this.#meanwhile.get(each.id)?.(each) ?? each);
      this.searched = text.trim();
      this.changed();
    });
  }

  /** @param {string} what @param {string} query @param {(entries: T[]) => void} take */
  #read(what, query, take) {
    return this.#reads.read(what, async () => {
      take(await request("GET", `${this.#resource}?${query}`));
      this.changed();
    });
  }

  /** @param {EventDocument} event */
  onEvent(event) {
    this.#onEvent(this, event);
  }
}

/**
 * The reads of one entry.
 * @template T
 */
export class EntryReader {
  #path;
  #concerns;
  #reads = new QuietReads();
  /** Called when something has changed. */
  changed = () => {};
  /** @type {T | null} */
  entry = null;
  /** The server's reason when the entry does not exist. */
  missing = "";

  /**
   * @param {string} path of the entry below /api/v1
   * @param {(event: EventDocument) => boolean} concerns whether an event is about this entry
   */
  constructor(path, concerns) {
    this.#path = path;
    this.#concerns = concerns;
  }

  readAll() {
    return this.#reads.read("entry", async () => {
      try {
        const entry = /** @type {T} */ (await request("GET", this.#path));
        await this.readMore(entry);
        Object.assign(this, { entry, missing: "" });
      } catch (error) {
        if (!(error instanceof RequestError) || error.document.status !== 404) throw error;
        Object.assign(this, { entry: null, missing: error.message });
      }
      this.changed();
    });
  }

  /** Read what is shown beside the entry, before it is shown. @param {T} _entry */
  async readMore(_entry) {}

  /** @param {T} entry the response to a command */
  adopt(entry) {
    Object.assign(this, { entry, missing: "" });
    this.changed();
  }

  /** @param {EventDocument} event */
  onEvent(event) {
    if (this.#concerns(event)) void this.readAll();
  }
}
