// Starts, resumes, pauses and cancels captures. The refusal of a start is returned, so that it is shown at its field.

/**
 * @import { CaptureDocument, CaptureRequest, JobDocument, Problem } from "#api"
 * @import { Commands, Store } from "#console"
 * @import { RequestError } from "../../transport/api.js"
 * @import { CaptureReader } from "./reader.js"
 */

/** The capture commands of one page. */
export class CaptureOrders {
  #store;
  #commands;
  #reader;

  /** @param {{store: Store, commands: Commands, reader: CaptureReader}} context */
  constructor({ store, commands, reader }) {
    this.#store = store;
    this.#commands = commands;
    this.#reader = reader;
  }

  /** @param {CaptureRequest} wish @returns {Promise<Problem | null>} the refusal */
  async start(wish) {
    const { answer, error } = await this.#commands.tried("POST", "/captures", {
      body: wish,
      shows: (refusal) => this.#hasAWayOut(refusal), // the message has a button
    });
    if (answer) this.#reader.follow(/** @type {JobDocument} */ (answer), { name: wish.name });
    return error?.document ?? null;
  }

  /** Resume a partial capture. @param {CaptureDocument} capture */
  async resume({ id, name }) {
    const job = /** @type {JobDocument | null} */ (await this.#commands.send("POST", `/captures/${id}/resume`));
    if (job) this.#reader.follow(job, { name, capture_id: id });
    else await this.#reader.readList();
  }

  pause() {
    return this.#turn("pause");
  }

  goOn() {
    return this.#turn("continue");
  }

  /** Cancel the running capture; its points stay on the disk. */
  async cancel() {
    this.#reader.mark("cancel");
    if ((await this.#reader.cancel(this.#commands)) === null) this.#reader.mark(null);
  }

  /** @param {"pause" | "continue"} how */
  async #turn(how) {
    const id = this.#store.state.capturing?.capture_id;
    if (!id) return;
    this.#reader.mark(how);
    const answer = await this.#commands.send("POST", `/captures/${id}/${how}`);
    if (answer === null) this.#reader.mark(null);
    else await this.#reader.readAll();
  }

  /** @param {RequestError} error */
  #hasAWayOut({ slug, message }) {
    const { lease, lease_token } = this.#store.state;
    return (
      slug === "stopped" || Boolean(slug === "busy" && lease?.holder && !lease_token && message.includes(lease.holder))
    );
  }
}
