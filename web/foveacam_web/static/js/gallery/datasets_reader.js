// Keeps the list of datasets and the trash equal to the server's while they are shown.

import { request } from "../api.js";
import { QuietReads } from "../quiet.js";

/**
 * @typedef {import("../types.js").RigEvent} RigEvent
 * @typedef {import("./documents.js").DatasetDocument} DatasetDocument
 * @typedef {DatasetDocument["progress"] & {capture_id: string, state: DatasetDocument["state"], wish: string}} ProgressNews
 */

/** Reads for one list. */
export class DatasetsReader {
  #changed;
  #reads = new QuietReads();
  #text = "";
  /** @type {DatasetDocument[] | null} */
  list = null;
  /** @type {DatasetDocument[] | null} */
  trash = null;
  /** What the list was searched for when it was read. */
  searched = "";

  /** @param {() => void} changed */
  constructor(changed) {
    this.#changed = changed;
  }

  readAll() {
    return Promise.all([this.#readList(), this.#readTrash()]);
  }

  /**
   * Show those that hold every word.
   * @param {string} text
   */
  search(text) {
    this.#text = text;
    return this.#readList();
  }

  #readList() {
    return this.#reads.read("datasets", async () => {
      const text = this.#text;
      this.list = /** @type {DatasetDocument[]} */ (await request("GET", `/captures?text=${encodeURIComponent(text)}`));
      this.searched = text.trim();
      this.#changed();
    });
  }

  #readTrash() {
    return this.#reads.read("trash", async () => {
      this.trash = /** @type {DatasetDocument[]} */ (await request("GET", "/captures?removed=true"));
      this.#changed();
    });
  }

  /** @param {RigEvent} event */
  hear({ kind, data }) {
    if (kind === "capture.progress") this.#progress(/** @type {any} */ (data)); // any: a report of the server, as its document says
    else if (kind.startsWith("capture.")) void this.readAll();
  }

  /** @param {ProgressNews} news */
  #progress(news) {
    const known = this.list?.find(({ id }) => id === news.capture_id);
    if (!known || known.state !== news.state || known.progress?.phase !== news.phase) void this.#readList();
    if (!known) return;
    this.list = (this.list ?? []).map((each) => (each === known ? withProgress(each, news) : each));
    this.#changed();
  }
}

/**
 * @param {DatasetDocument} dataset
 * @param {ProgressNews} news
 * @returns {DatasetDocument}
 */
export function withProgress(dataset, { capture_id: _, state, wish, ...progress }) {
  return { ...dataset, state, why: wish, progress };
}
