// Makes, reads, renames and deletes measurements; a deletion can be undone.

import { RequestError, request } from "../api.js";
import { QuietReads } from "../quiet.js";

/**
 * @import { MeasurementDocument, PlaceRequest } from "#api"
 * @import { MeasureKind } from "#page"
 * @import { Commands } from "../commands.js"
 * @import { Store } from "../store.js"
 */

const UNDO_MS = 6000;
const PATIENCE_MS = 30_000;

/** The measurement commands of one page. */
export class MeasureOrders {
  #store;
  #commands;
  #reads = new QuietReads();
  /** @type {Map<string, ReturnType<typeof setTimeout>>} */
  #deletions = new Map();

  /** @param {{store: Store, commands: Commands}} context */
  constructor({ store, commands }) {
    this.#store = store;
    this.#commands = commands;
    window.addEventListener("pagehide", () => this.#deletions.forEach((_, id) => void this.#deleteNow(id)));
  }

  readAll() {
    return this.#reads.read("measurements", async () => {
      this.#store.set({ measurements: /** @type {MeasurementDocument[]} */ (await request("GET", "/measurements")) });
    });
  }

  /** @param {import("#api").EventDocument} event */
  hear(event) {
    if (event.kind.startsWith("measurement.")) void this.readAll();
  }

  /**
   * Make a measurement and select it. A refusal is shown, and null returned.
   * @param {MeasureKind} kind
   * @param {PlaceRequest[]} points
   * @returns {Promise<MeasurementDocument | null>}
   */
  async measure(kind, points) {
    const made = await this.#commands.attempt(
      () =>
        /** @type {Promise<MeasurementDocument>} */ (
          request("POST", "/measurements", { body: { kind, points }, patience_ms: PATIENCE_MS })
        ),
    );
    if (!made) return null;
    const others = (this.#store.state.measurements ?? []).filter(({ id }) => id !== made.id);
    this.#store.set({ measurements: [made, ...others], selected_measurement: made.id });
    return made;
  }

  /**
   * @param {string} id
   * @param {string} label
   */
  rename(id, label) {
    return this.#commands.attempt(() => request("PATCH", `/measurements/${id}`, { body: { label } }));
  }

  /** @param {MeasurementDocument} measured hidden now, deleted when the time to undo is over */
  remove({ id, label }) {
    this.#store.set({ hidden_measurements: [...this.#store.state.hidden_measurements, id] });
    this.#deletions.set(
      id,
      setTimeout(() => void this.#deleteNow(id), UNDO_MS),
    );
    this.#commands.say({
      tone: "info",
      title: `Deleted “${label}”`,
      detail: "",
      stay_ms: UNDO_MS,
      action: { label: "Undo", act: () => this.#restore(id) },
    });
  }

  /** @param {string} id */
  #restore(id) {
    clearTimeout(this.#deletions.get(id));
    this.#deletions.delete(id);
    this.#unhide(id);
  }

  /** @param {string} id */
  async #deleteNow(id) {
    if (!this.#deletions.delete(id)) return;
    try {
      await request("DELETE", `/measurements/${id}`, { keepalive: true });
      this.#store.set({ measurements: (this.#store.state.measurements ?? []).filter((kept) => kept.id !== id) });
    } catch (error) {
      if (!(error instanceof RequestError)) throw error;
      // another page may have deleted it
      if (error.slug !== "not-found") await this.#commands.attempt(() => Promise.reject(error));
    }
    this.#unhide(id);
  }

  /** @param {string} id */
  #unhide(id) {
    this.#store.set({ hidden_measurements: this.#store.state.hidden_measurements.filter((hidden) => hidden !== id) });
  }
}

/**
 * Return the visible measurements, newest first.
 * @param {import("#page").ConsoleState} state
 */
export function shownOf({ measurements, hidden_measurements }) {
  return (measurements ?? []).filter(({ id }) => !hidden_measurements.includes(id));
}
