// Takes, keeps, discards, restores, describes and checks stills.

import { RequestError, request } from "../api.js";
import { galleryAddress } from "../gallery/route.js";
import { Trash } from "../gallery/trash.js";

/**
 * @import { JobDocument, Problem, StillCheck, StillDocument, StillRequest } from "#api"
 * @import { Commands } from "../commands.js"
 * @typedef {Pick<StillDocument, "id" | "name">} Named
 */

const CHECK_MS = 120_000;

/**
 * @param {string} id
 * @param {string} [rest]
 */
export function stillPath(id, rest = "") {
  return `/stills/${encodeURIComponent(id)}${rest}`;
}

/** The still commands of one page. */
export class StillOrders {
  #commands;
  #changed;

  /** @param {{commands: Commands, changed?: () => unknown}} context `changed`: called when an order has changed what there is */
  constructor({ commands, changed = () => {} }) {
    this.#commands = commands;
    this.#changed = changed;
    this.trash = new Trash({ commands, resource: "/stills", changed });
  }

  /**
   * @param {StillRequest} wish
   * @returns {Promise<JobDocument | Problem>} a problem has a `status`
   */
  async take(wish) {
    try {
      return /** @type {JobDocument} */ (
        await request("POST", "/stills", { body: wish, headers: this.#commands.leaseHeader() })
      );
    } catch (error) {
      if (!(error instanceof RequestError)) throw error;
      // shown as a message with a button
      if (error.slug === "stopped") await this.#commands.attempt(() => Promise.reject(error));
      return error.document;
    }
  }

  /**
   * @param {string} id
   * @param {string} name
   */
  async keep(id, name) {
    const kept = await this.#commands.attempt(
      () =>
        /** @type {Promise<StillDocument>} */ (
          request("POST", stillPath(id, "/keep"), { body: name === "" ? {} : { name } })
        ),
    );
    if (kept) this.sayKept(kept);
    this.#changed();
    return kept !== null;
  }

  /** @param {Named} still */
  sayKept({ id, name }) {
    this.#commands.say({
      tone: "good",
      title: `“${name}” is kept`,
      detail: "",
      action: { label: "Show it in the gallery", act: () => (location.hash = galleryAddress("stills", id)) },
    });
  }

  /**
   * @param {string} id
   * @param {{label?: string, licence?: string}} change
   */
  describe(id, change) {
    return this.#commands.attempt(
      () => /** @type {Promise<StillDocument>} */ (request("PATCH", stillPath(id), { body: change })),
    );
  }

  /** @param {string} id */
  check(id) {
    return this.#commands.attempt(
      () => /** @type {Promise<StillCheck>} */ (request("POST", stillPath(id, "/check"), { patience_ms: CHECK_MS })),
    );
  }
}
