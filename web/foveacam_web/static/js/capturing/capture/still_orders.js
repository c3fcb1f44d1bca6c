// Takes stills, and keeps them.

import { CollectionOrders } from "../gallery/collection_orders.js";
import { galleryAddress } from "../../addresses.js";

/**
 * @import { JobDocument, Problem, StillDocument, StillRequest } from "#api"
 * @import { Commands } from "#console"
 */

/** The still commands of one page. @extends {CollectionOrders<StillDocument>} */
export class StillOrders extends CollectionOrders {
  /** @param {{commands: Commands, changed?: () => unknown}} context `changed`: called when an order has changed what there is */
  constructor({ commands, changed }) {
    super({ commands, resource: "/stills", changed });
  }

  /** @param {StillRequest} wish @returns {Promise<JobDocument | Problem>} a problem has a `status` */
  async take(wish) {
    const { answer, error } = await this.commands.tried("POST", this.resource, {
      body: wish,
      shows: ({ slug }) => slug === "stopped", // the message has a button
    });
    return error?.document ?? /** @type {JobDocument} */ (answer);
  }

  /** @param {string} id @param {string} name */
  async keep(id, name) {
    const body = name === "" ? {} : { name };
    const kept = /** @type {StillDocument | null} */ (
      await this.commands.send("POST", this.path(id, "/keep"), { body })
    );
    if (kept) this.notifyKept(kept);
    this.changed();
    return kept !== null;
  }

  /** @param {Pick<StillDocument, "id" | "name">} still */
  notifyKept({ id, name }) {
    this.commands.notify({
      tone: "good",
      title: `“${name}” is kept`,
      detail: "",
      action: { label: "Show it in the gallery", act: () => (location.hash = galleryAddress("stills", id)) },
    });
  }
}
