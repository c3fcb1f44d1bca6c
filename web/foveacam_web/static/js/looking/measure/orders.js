// Makes, reads, renames and deletes measurements; a deletion can be undone.

import { Deletions } from "../../deletions.js";
import { RequestError, outcome, request } from "../../transport/api.js";
import { QuietReads } from "../../transport/quiet.js";
import { doubtWords, unseenWords } from "./words.js";

/**
 * @import { MeasurementDocument, PlaceRequest } from "#api"
 * @import { Commands, MeasureKind, Store } from "#console"
 */

const PATIENCE_MS = 30_000;
const NOT_LOOKED_AT = "not-looked-at";
const LOOK = "Look there, then measure";
const LOOKED_MS = 8000;
const ASK_MS = 250;

/** The measurement commands of one page. */
export class MeasureOrders {
  #store;
  #commands;
  #reads = new QuietReads();
  #deletions;
  #withdraw = () => {};

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
   * Make a measurement and select it. A refusal is shown, and null returned; where no fovea has looked yet, looking there
   * is offered.
   * @param {MeasureKind} kind
   * @param {PlaceRequest[]} points
   * @returns {Promise<MeasurementDocument | null>}
   */
  async measure(kind, points) {
    this.withdraw();
    const { made, unseen } = await this.#tried(kind, points);
    if (unseen) await this.#offerLook(kind, points);
    return made;
  }

  /** Take back what the last measurement was told: its refusal, or the offer to look at its places. */
  withdraw() {
    this.#withdraw();
    this.#withdraw = () => {};
  }

  /** @param {MeasureKind} kind @param {PlaceRequest[]} points */
  async #tried(kind, points) {
    const options = { body: { kind, points }, patience_ms: PATIENCE_MS };
    const shows = (/** @type {RequestError} */ { slug }) => slug !== NOT_LOOKED_AT;
    const { answer, error, dismiss } = await this.#commands.tried("POST", "/measurements", { ...options, shows });
    this.#withdraw = dismiss;
    const made = /** @type {MeasurementDocument | null} */ (answer);
    if (made) {
      const others = (this.#store.state.measurements ?? []).filter(({ id }) => id !== made.id);
      this.#store.set({ measurements: [made, ...others], selected_measurement: made.id });
      this.#tellDoubt(made);
    }
    return { made, unseen: error?.slug === NOT_LOOKED_AT };
  }

  /** Warn of a measurement whose points are too uncertain to be of use. @param {MeasurementDocument} made */
  #tellDoubt(made) {
    const detail = doubtWords(made);
    if (detail === "") return;
    this.#withdraw = this.#commands.notify({
      tone: "warn",
      title: "This is uncertain",
      detail,
      remedy: "Measure at a place a little farther inside.",
    });
  }

  /**
   * Offer to look at those of the places that no fovea has shown, one after the other, and to measure then.
   * @param {MeasureKind} kind
   * @param {PlaceRequest[]} points
   */
  async #offerLook(kind, points) {
    const seen = await Promise.all(points.map(isSeen));
    const unseen = points.filter((_, index) => !seen[index]);
    const can_look = unseen.every(({ view }) => view === "wide");
    this.#withdraw = this.#commands.notify({
      tone: "warn",
      title: unseenWords(seen),
      detail: "Look there to measure it.",
      action: can_look ? { label: LOOK, act: () => this.#lookAndMeasure(kind, points, unseen) } : null,
      stay_ms: PATIENCE_MS,
    });
  }

  /**
   * @param {MeasureKind} kind
   * @param {PlaceRequest[]} points
   * @param {PlaceRequest[]} unseen
   */
  async #lookAndMeasure(kind, points, unseen) {
    for (const place of unseen) {
      if (!(await this.#commands.fixate({ pixel: { x_px: place.x_px, y_px: place.y_px } }))) return;
      if (await until(() => isSeen(place))) continue;
      this.#withdraw = this.#commands.notify({
        tone: "warn",
        title: "Not measured",
        detail: "A fovea looked there, but no depth could be matched.",
        remedy: "Choose a place with texture close by.",
      });
      return;
    }
    await this.#tried(kind, points);
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

/** Return whether a fovea has shown a place; of a view of the foveae it has. @param {PlaceRequest} place */
async function isSeen({ view, x_px, y_px }) {
  if (view !== "wide") return true;
  const { error } = await outcome(request("GET", `/depth?x_px=${x_px}&y_px=${y_px}`));
  return error?.slug !== NOT_LOOKED_AT;
}

/** Wait until something holds; return false where it does not in time. @param {() => Promise<boolean>} holds */
async function until(holds) {
  for (const end_ms = performance.now() + LOOKED_MS; performance.now() < end_ms;) {
    if (await holds()) return true;
    await new Promise((resolve) => setTimeout(resolve, ASK_MS));
  }
  return false;
}
