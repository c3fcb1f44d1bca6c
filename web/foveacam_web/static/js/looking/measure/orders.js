// Makes, reads, renames and deletes measurements; a deletion can be undone.

import { Deletions } from "../../deletions.js";
import { QuietReads } from "../../transport/quiet.js";

/**
 * @import { MeasurementDocument, PlaceRequest } from "#api"
 * @import { Commands, MeasureKind, Store } from "#console"
 * @import { RequestError } from "../../transport/api.js"
 */

const PATIENCE_MS = 30_000;
const NOT_LOOKED_AT = "not-looked-at";

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
   * @param {number} [looks] how many of the places were looked at for it
   * @returns {Promise<MeasurementDocument | null>}
   */
  async measure(kind, points, looks = 0) {
    const options = { body: { kind, points }, patience_ms: PATIENCE_MS };
    const shows = (/** @type {RequestError} */ { slug }) => slug !== NOT_LOOKED_AT;
    const { answer, error } = await this.#commands.tried("POST", "/measurements", { ...options, shows });
    if (error?.slug === NOT_LOOKED_AT) this.#offerLook(error, kind, points, looks);
    const made = /** @type {MeasurementDocument | null} */ (answer);
    if (!made) return null;
    const others = (this.#store.state.measurements ?? []).filter(({ id }) => id !== made.id);
    this.#store.set({ measurements: [made, ...others], selected_measurement: made.id });
    return made;
  }

  /**
   * Offer to look at the next of the places in the wide view, and to measure then.
   * @param {RequestError} error
   * @param {MeasureKind} kind
   * @param {PlaceRequest[]} points
   * @param {number} looks
   */
  #offerLook(error, kind, points, looks) {
    const there = points.filter(({ view }) => view === "wide")[looks];
    const act = async () => {
      if (!there) return;
      const before = this.#store.state.clouds[0]?.id;
      await this.#commands.fixate({ pixel: { x_px: there.x_px, y_px: there.y_px } });
      const patience = new Promise((resolve) => setTimeout(resolve, PATIENCE_MS, null));
      const found = this.#store.until(["clouds"], ({ clouds }) => clouds[0]?.id !== before);
      if (await Promise.race([found, patience])) await this.measure(kind, points, looks + 1);
    };
    this.#commands.notify({
      tone: "warn",
      title: error.document.title,
      detail: "A place can be measured once a fovea has looked at it.",
      action: there ? { label: "Look here, then measure", act } : null,
      stay_ms: PATIENCE_MS,
    });
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
