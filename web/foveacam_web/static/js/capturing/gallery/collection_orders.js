// Sends the commands of one collection: trash, restore, empty, describe, check.

import { RequestError } from "../../transport/api.js";

/**
 * @import { JobDocument } from "#api"
 * @import { Commands, Job } from "#console"
 * @import { JobFollower } from "../../transport/jobs.js"
 */

const UNDO_MS = 15_000;
const CHECK_MS = 1_800_000; // some seconds a gigabyte on a slow disk

/**
 * The commands of one collection.
 * @template {{id: string, name: string}} T its documents
 */
export class CollectionOrders {
  /**
   * @param {{commands: Commands, resource: string, changed?: () => unknown}} context
   *   `resource`: its path below /api/v1; `changed`: called after each command that has changed the list
   */
  constructor({ commands, resource, changed = () => {} }) {
    this.commands = commands;
    this.resource = resource;
    this.changed = changed;
  }

  /** Return the path of an entry below /api/v1. */
  path(/** @type {string} */ id, rest = "") {
    return `${this.resource}/${encodeURIComponent(id)}${rest}`;
  }

  /**
   * Move an entry to the trash; return whether the server accepted it.
   * @param {Pick<T, "id" | "name">} entry
   * @param {string} [became] the text of the message, after the name
   */
  async remove(entry, became = "is in the trash") {
    const gone = await this.commands.send("DELETE", this.path(entry.id));
    if (gone)
      this.commands.notify({
        tone: "info",
        title: `“${entry.name}” ${became}`,
        detail: "",
        stay_ms: UNDO_MS,
        action: { label: "Undo", act: () => this.restore(entry) },
      });
    this.changed();
    return gone !== null;
  }

  /** @param {Pick<T, "id" | "name">} entry */
  async restore({ id, name }) {
    const back = /** @type {T | null} */ (await this.commands.send("POST", this.path(id, "/restore")));
    if (back && back.name !== name)
      this.commands.notify({
        tone: "info",
        title: `Restored as “${back.name}”`,
        detail: `There is another “${name}” by now.`,
      });
    this.changed();
  }

  /** Delete everything in the trash for good. */
  async empty() {
    await this.commands.send("DELETE", `${this.resource}/trash`);
    this.changed();
  }

  /**
   * Change the label or the licence; return the entry, or null when it was refused.
   * @param {string} id
   * @param {{label?: string, licence?: string}} change
   * @returns {Promise<T | null>}
   */
  describe(id, change) {
    return this.commands.send("PATCH", this.path(id), { body: change });
  }

  /**
   * Start a job and follow it.
   * @param {string} path that starts it
   * @param {object | undefined} body
   * @param {JobFollower} jobs
   */
  async start(path, body, jobs) {
    const job = /** @type {JobDocument | null} */ (await this.commands.send("POST", path, { body }));
    if (job) jobs.follow(job);
    return job !== null;
  }

  /** Show why a job has failed, if it has. @param {Job} job */
  async notifyEnd({ state, problem }) {
    if (state === "failed" && problem) await this.commands.attempt(() => Promise.reject(new RequestError(problem)));
  }

  /**
   * Check every file; the response arrives when all were read.
   * @param {string} id
   * @returns {Promise<{sound: boolean, faults: string[]} | null>}
   */
  check(id) {
    return this.commands.send("POST", this.path(id, "/check"), { patience_ms: CHECK_MS });
  }
}
