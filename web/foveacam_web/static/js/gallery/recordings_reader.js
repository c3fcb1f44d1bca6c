// Keeps the list of recordings and the trash equal to the server's while they are shown.

import { request } from "../api.js";
import { QuietReads } from "../quiet.js";

/** @typedef {import("./recording_documents.js").RecordingDocument} RecordingDocument */

/** Reads for one list. */
export class RecordingsReader {
  #changed;
  #reads = new QuietReads();
  #text = "";
  /** @type {RecordingDocument[] | null} */
  list = null;
  /** @type {RecordingDocument[] | null} */
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

  /**
   * Show how far the one is that is being made, without reading all.
   * @param {RecordingDocument | null} live
   */
  follow(live) {
    if (live === null || !this.list?.some(({ id }) => id === live.id)) return;
    this.list = this.list.map((each) => (each.id === live.id ? live : each));
    this.#changed();
  }

  #readList() {
    return this.#reads.read("recordings", async () => {
      const text = this.#text;
      this.list = /** @type {RecordingDocument[]} */ (await request("GET", `/recordings?text=${encodeURIComponent(text)}`));
      this.searched = text.trim();
      this.#changed();
    });
  }

  #readTrash() {
    return this.#reads.read("trash", async () => {
      this.trash = /** @type {RecordingDocument[]} */ (await request("GET", "/recordings?removed=true"));
      this.#changed();
    });
  }

  /** @param {import("../types.js").RigEvent} event */
  hear({ kind }) {
    if (kind.startsWith("recording.")) void this.readAll();
  }
}
