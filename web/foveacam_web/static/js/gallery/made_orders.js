// What the operator can order of what is made of a dataset: make, cancel, remove.

import { request } from "../api.js";
import { capturePath } from "./dataset_orders.js";

/**
 * The orders of one page.
 * @template {import("#page").MakingDocument} T
 * @template W what may be asked for
 */
export class MadeOrders {
  /**
   * @param {string} id of the dataset
   * @param {"mosaic" | "reference"} kind
   * @param {{commands: import("../commands.js").Commands, reader: import("./made_reader.js").MadeReader<T>}} context
   */
  constructor(id, kind, { commands, reader }) {
    this.path = capturePath(id, `/${kind}`);
    this.commands = commands;
    this.reader = reader;
  }

  /** @param {W} wish */
  async make(wish) {
    this.reader.forget();
    await this.commands.attempt(() => request("POST", this.path, { body: wish }));
    await this.reader.readAll();
  }

  async cancel() {
    const job = this.reader.document?.job_id;
    if (job) await this.commands.attempt(() => request("POST", `/jobs/${job}/cancel`));
    await this.reader.readAll();
  }

  async remove() {
    await this.commands.attempt(() => request("DELETE", this.path));
    await this.reader.readAll();
  }
}
