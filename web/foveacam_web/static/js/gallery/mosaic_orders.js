// Makes, cancels and removes a mosaic, and shows it in 3D.

import { request } from "../api.js";
import { addressOf } from "../calibration/route.js";
import { MadeOrders } from "./made_orders.js";

/** @import { MosaicDocument, MosaicRequest } from "#api" */

const MESH_MS = 60_000; // about ten megabytes are packed for every viewer

/**
 * The mosaic commands of one page.
 * @extends {MadeOrders<MosaicDocument, MosaicRequest>}
 */
export class MosaicOrders extends MadeOrders {
  /**
   * @param {string} id of the dataset
   * @param {{commands: import("../commands.js").Commands, reader: import("./made_reader.js").MadeReader<MosaicDocument>}} context
   */
  constructor(id, context) {
    super(id, "mosaic", context);
  }

  /** @param {boolean} shown */
  async show(shown) {
    const path = `${this.path}/in_scene`;
    const mosaic = await this.commands.attempt(
      () => /** @type {Promise<MosaicDocument>} */ (request(shown ? "PUT" : "DELETE", path, { patience_ms: MESH_MS })),
    );
    if (!mosaic) return;
    this.reader.adopt(mosaic);
    if (shown)
      this.commands.say({
        tone: "good",
        title: "The surface is in the 3D view",
        detail: "It stays there until it is taken away.",
        action: { label: "Go there", act: () => (location.hash = addressOf(null)) },
      });
  }
}
