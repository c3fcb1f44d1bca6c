// Makes, reads, renames and deletes measurements; a deletion can be undone.

import { Deletions } from "../../deletions.js";
import { QuietReads } from "../../transport/quiet.js";

/**
 * @import { MeasurementDocument, PlaceRequest } from "#api"
 * @import { Commands, MeasureKind, Store } from "#console"
 */

const PATIENCE_MS = 30_000;

/** The measurement commands of one page. */
export class MeasureOrders {
  #store;
  #commands;
  #reads = new QuietReads();
  #deletions;

  /** @param {{store: Store, commands: Commands}} context */
  constructor({ store, commands }) {
    this.#store = store;
    this.#commands = commands;
    this.#deletions = new Deletions({
      commands,
      resource: "/measurements",
      changed: (hidden_measurements, gone) =>
        store.set({
          hidden_measurements,
          measurements: (store.state.measurements ?? []).filter(({ id }) => id !== gone),
        }),
    });
  }

  readAll() {
    return this.#reads.keep(this.#store, "measurements", "/measurements");
  }

  /** @param {import("#api").EventDocument} event */
  onEvent(event) {
    if (event.kind.startsWith("measurement.")) void this.readAll();
  }

  /**
   * Make a measurement and select it. A refusal is shown, and null returned.
   * @param {MeasureKind} kind
   * @param {PlaceRequest[]} points
   * @returns {Promise<MeasurementDocument | null>}
   */
  async measure(kind, points) {
    const options = { body: { kind, points }, patience_ms: PATIENCE_MS };
    const made = /** @type {MeasurementDocument | null} */ (
      await this.#commands.send("POST", "/measurements", options)
    );
    if (!made) return null;
    const others = (this.#store.state.measurements ?? []).filter(({ id }) => id !== made.id);
    this.#store.set({ measurements: [made, ...others], selected_measurement: made.id });
    return made;
  }

  /** @param {string} id @param {string} label */
  rename(id, label) {
    return this.#commands.send("PATCH", `/measurements/${id}`, { body: { label } });
  }

  /** @param {MeasurementDocument} measured hidden now, deleted when the time to undo is over */
  remove(measured) {
    this.#deletions.add(measured);
  }
}
