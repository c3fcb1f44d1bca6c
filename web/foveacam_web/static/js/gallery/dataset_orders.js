// Removes, restores, describes, checks and resumes datasets.

import { request } from "../api.js";
import { Trash } from "./trash.js";

/**
 * @import { CaptureChecked, CaptureDocument } from "#api"
 * @import { Commands } from "../commands.js"
 */

const CHECK_MS = 1_800_000; // some seconds a gigabyte on a slow disk

/**
 * Return the path of a capture below /api/v1.
 * @param {string} id
 * @param {string} [rest]
 */
export function capturePath(id, rest = "") {
  return `/captures/${encodeURIComponent(id)}${rest}`;
}

/** The dataset commands of one page. */
export class DatasetOrders {
  #commands;

  /** @param {{commands: Commands, changed?: () => unknown}} context `changed`: called when an order has changed what there is */
  constructor({ commands, changed = () => {} }) {
    this.#commands = commands;
    this.trash = new Trash({ commands, resource: "/captures", changed });
  }

  /**
   * @param {string} id
   * @param {{label?: string, licence?: string}} change
   * @returns {Promise<CaptureDocument | null>} null when it was refused
   */
  describe(id, change) {
    return this.#commands.attempt(
      () => /** @type {Promise<CaptureDocument>} */ (request("PATCH", capturePath(id), { body: change })),
    );
  }

  /**
   * Check every file; the response arrives when all were read.
   * @param {string} id
   * @returns {Promise<CaptureChecked | null>}
   */
  check(id) {
    return this.#commands.attempt(
      () =>
        /** @type {Promise<CaptureChecked>} */ (request("POST", capturePath(id, "/check"), { patience_ms: CHECK_MS })),
    );
  }

  /**
   * Resume a partial dataset.
   * @param {string} id
   * @returns {Promise<boolean>}
   */
  async resume(id) {
    return (
      (await this.#commands.attempt(() =>
        request("POST", capturePath(id, "/resume"), { headers: this.#commands.leaseHeader() }),
      )) !== null
    );
  }
}
