// Makes, cancels and removes what the server makes of a dataset: its mosaic or its reference.

import { request } from "../api.js";
import { capturePath } from "./dataset_orders.js";

/**
 * The commands of one page.
 * @template {import("#page").MakingDocument} T
 * @template W the request model
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
