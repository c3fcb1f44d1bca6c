// Passes the server's events to what the gallery shows.

/**
 * @import { EventDocument } from "#api"
 * @import { Reader } from "../../transport/sync.js"
 */

/** Passes the server's events and each reconnection to the readers of what the gallery shows. */
export class GalleryReader {
  /** @type {Set<Reader>} */
  #readers = new Set();

  /**
   * Let a reader read now and after each reconnection, and receive events, until the signal is aborted.
   * @param {Reader} reader
   * @param {AbortSignal} signal
   */
  follow(reader, signal) {
    this.#readers.add(reader);
    signal.addEventListener("abort", () => {
      this.#readers.delete(reader);
      reader.forget?.();
    });
    void reader.readAll();
  }

  readAll() {
    return Promise.all([...this.#readers].map((reader) => reader.readAll()));
  }

  /** @param {EventDocument} event */
  onEvent(event) {
    for (const reader of this.#readers) reader.onEvent(event);
  }
}
