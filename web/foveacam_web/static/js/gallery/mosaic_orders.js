// What the operator can order of a mosaic: make, cancel, remove, show in 3D.

import { request } from "../api.js";
import { addressOf } from "../calibration/route.js";
import { capturePath } from "./dataset_orders.js";

/**
 * @typedef {import("./mosaic_documents.js").MosaicDocument} MosaicDocument
 * @typedef {import("./mosaic_documents.js").MosaicWish} MosaicWish
 */

const MESH_MS = 60_000; // some ten megabytes are packed for every viewer

/** The orders of one page. */
export class MosaicOrders {
  #path;
  #reader;
  #commands;

  /**
   * @param {string} id of the dataset
   * @param {{commands: import("../commands.js").Commands, reader: import("./mosaic_reader.js").MosaicReader}} context
   */
  constructor(id, { commands, reader }) {
    this.#path = capturePath(id, "/mosaic");
    this.#commands = commands;
    this.#reader = reader;
  }

  /** @param {MosaicWish} wish */
  async make(wish) {
    this.#reader.forget();
    await this.#commands.attempt(() => request("POST", this.#path, { body: wish }));
    await this.#reader.readAll();
  }

  async cancel() {
    const job = this.#reader.mosaic?.job_id;
    if (job) await this.#commands.attempt(() => request("POST", `/jobs/${job}/cancel`));
    await this.#reader.readAll();
  }

  async remove() {
    await this.#commands.attempt(() => request("DELETE", this.#path));
    await this.#reader.readAll();
  }

  /** @param {boolean} shown */
  async show(shown) {
    const path = `${this.#path}/in_scene`;
    const mosaic = await this.#commands.attempt(() =>
      /** @type {Promise<MosaicDocument>} */ (request(shown ? "PUT" : "DELETE", path, { patience_ms: MESH_MS })));
    if (!mosaic) return;
    this.#reader.adopt(mosaic);
    if (shown) this.#commands.say({ tone: "good", title: "The surface is in the 3D view", detail: "It stays there until it is taken away.", action: { label: "Go there", act: () => (location.hash = addressOf(null)) } });
  }
}
