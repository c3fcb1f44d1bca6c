// The server's jobs: whether one has ended, and reading one again in case its events do not arrive.

import { RequestError, request } from "./api.js";

/** @import { JobDocument, Problem } from "#api" */

/** @param {string} state of a job */
export function hasEnded(state) {
  return state === "cancelled" || state === "failed" || state === "succeeded";
}

/** Reads one job after a pause. */
export class JobWatch {
  #every_ms;
  #found;
  #lost;
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  #timer;

  /**
   * @param {{every_ms: number, found: (job: JobDocument) => void, lost: (problem: Problem) => unknown}} context
   *   `lost`: called when the server refuses to show the job; while the server is away, the job is read again
   */
  constructor({ every_ms, found, lost }) {
    this.#every_ms = every_ms;
    this.#found = found;
    this.#lost = lost;
  }

  /** @param {string} id of the job to read after the pause, in place of an earlier one */
  watch(id) {
    this.stop();
    this.#timer = setTimeout(() => void this.read(id), this.#every_ms);
  }

  stop() {
    clearTimeout(this.#timer);
  }

  /** @param {string} id */
  async read(id) {
    try {
      this.#found(await request("GET", `/jobs/${id}`));
    } catch (error) {
      if (!(error instanceof RequestError)) throw error;
      if (error.slug === "offline") this.watch(id);
      else this.#lost(error.document);
    }
  }
}
