// Removes, restores and describes recordings, computes depth, and makes films.

import { RequestError, request } from "../api.js";
import { recordingPath } from "./recording_words.js";
import { Trash } from "./trash.js";

/**
 * @import { JobDocument, RecordedDepthDocument } from "#api"
 * @import { FilmShow } from "#page"
 * @import { Commands } from "../commands.js"
 */

const LOOK_MS = 400;
const DEPTH_MS = 60_000; // the matcher takes a second, and other requests may be queued before this one

/** The recording commands of one page. */
export class RecordingOrders {
  #commands;
  #changed;

  /** @param {{commands: Commands, changed?: () => unknown}} context `changed`: called when an order has changed what there is */
  constructor({ commands, changed = () => {} }) {
    this.#commands = commands;
    this.#changed = changed;
    this.trash = new Trash({ commands, resource: "/recordings", changed });
  }

  /**
   * @param {string} id
   * @param {string} label
   * @returns {Promise<boolean>} whether the server accepted it
   */
  async describe(id, label) {
    const taken =
      (await this.#commands.attempt(() => request("PATCH", recordingPath(id), { body: { label } }))) !== null;
    if (taken) this.#changed();
    return taken;
  }

  /**
   * Return the depth of a moment, or the reason why there is none.
   * @param {string} id
   * @param {number} t_s
   * @returns {Promise<RecordedDepthDocument | RequestError>}
   */
  async depth(id, t_s) {
    try {
      return await request("GET", recordingPath(id, `/depth?t_s=${t_s.toFixed(6)}&backend=live`), {
        patience_ms: DEPTH_MS,
      });
    } catch (error) {
      if (error instanceof RequestError) return error;
      throw error;
    }
  }

  /**
   * Make a film and return its document; null when it was refused, failed or was abandoned.
   * @param {string} id
   * @param {FilmShow} show
   * @param {{told: (done: number, total: number) => void, signal: AbortSignal}} how
   * @returns {Promise<string | null>}
   */
  film(id, show, { told, signal }) {
    return this.#commands.attempt(async () => {
      let job = /** @type {JobDocument} */ (await request("POST", recordingPath(id, "/films"), { body: { show } }));
      while (job.ended_utc === null) {
        if (signal.aborted) return null;
        await new Promise((resolve) => setTimeout(resolve, LOOK_MS));
        job = /** @type {JobDocument} */ (await request("GET", `/jobs/${job.id}`));
        told(job.progress?.done ?? 0, job.progress?.total ?? 0);
      }
      if (job.problem) throw new RequestError(job.problem);
      return job.result_url;
    });
  }
}
