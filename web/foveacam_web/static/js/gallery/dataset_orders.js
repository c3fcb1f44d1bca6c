// What the operator can order of datasets: remove, restore, describe, check, go on.

import { request } from "../api.js";

/**
 * @typedef {import("../commands.js").Commands} Commands
 * @typedef {import("./documents.js").CaptureChecked} CaptureChecked
 * @typedef {import("./documents.js").DatasetDocument} DatasetDocument
 * @typedef {Pick<DatasetDocument, "id" | "name">} Named
 */

const UNDO_MS = 15_000;
const CHECK_MS = 1_800_000; // some seconds a gigabyte, from a slow disk

/**
 * The path of a capture below /api/v1.
 * @param {string} id
 * @param {string} [rest]
 */
export function capturePath(id, rest = "") {
  return `/captures/${encodeURIComponent(id)}${rest}`;
}

/** The orders of one page. */
export class DatasetOrders {
  #commands;
  #changed;

  /** @param {{commands: Commands, changed?: () => unknown}} context `changed`: called when an order has changed what there is */
  constructor({ commands, changed = () => {} }) {
    this.#commands = commands;
    this.#changed = changed;
  }

  /**
   * Put a dataset in the trash, with a way back.
   * @param {Named} dataset
   * @returns {Promise<boolean>}
   */
  async remove({ id, name }) {
    const gone = await this.#commands.attempt(() => request("DELETE", capturePath(id)).then(() => true));
    if (gone) this.#commands.say({ tone: "info", title: `“${name}” is in the trash`, detail: "", stay_ms: UNDO_MS, action: { label: "Undo", act: () => this.restore({ id, name }) } });
    this.#changed();
    return gone === true;
  }

  /** @param {Named} dataset */
  async restore({ id, name }) {
    const back = await this.#commands.attempt(() => /** @type {Promise<DatasetDocument>} */ (request("POST", capturePath(id, "/restore"))));
    if (back && back.name !== name) this.#commands.say({ tone: "info", title: `Restored as “${back.name}”`, detail: `There is another “${name}” by now.` });
    this.#changed();
  }

  async emptyTrash() {
    await this.#commands.attempt(() => request("DELETE", "/captures/trash"));
    this.#changed();
  }

  /**
   * @param {string} id
   * @param {{label?: string, licence?: string}} change
   * @returns {Promise<DatasetDocument | null>} null when it was refused
   */
  describe(id, change) {
    return this.#commands.attempt(() => /** @type {Promise<DatasetDocument>} */ (request("PATCH", capturePath(id), { body: change })));
  }

  /**
   * Read every file again; the answer comes when all were read.
   * @param {string} id
   * @returns {Promise<CaptureChecked | null>}
   */
  check(id) {
    return this.#commands.attempt(() => /** @type {Promise<CaptureChecked>} */ (request("POST", capturePath(id, "/check"), { patience_ms: CHECK_MS })));
  }

  /**
   * Take the rest of a partial dataset.
   * @param {string} id
   * @returns {Promise<boolean>}
   */
  async resume(id) {
    return (await this.#commands.attempt(() => request("POST", capturePath(id, "/resume"), { headers: this.#commands.leaseHeader() }))) !== null;
  }
}
