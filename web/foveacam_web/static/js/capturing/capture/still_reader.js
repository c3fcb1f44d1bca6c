// Follows the still that is being taken, and reads the stills that wait to be kept or discarded.

import { request } from "../../transport/api.js";
import { hasEnded, JobFollower, resultPath } from "../../transport/jobs.js";
import { QuietReads } from "../../transport/quiet.js";

/**
 * @import { EventDocument, StillDocument } from "#api"
 * @import { Job } from "#page"
 */

/** The still reads of one page. */
export class StillReader {
  #reads = new QuietReads();
  /** Follows the still that is being taken, by this or any other client. */
  jobs = new JobFollower({ ours: ({ kind }) => kind === "still", news: (job) => this.#take(job) });
  /** The stills neither kept nor discarded, newest first; null before the first read. @type {StillDocument[] | null} */
  held = null;
  /** Called when the shown state has changed. */
  changed = () => {};
  /** Called with each still that was taken. @type {(still: StillDocument) => void} */
  taken = () => {};

  async readAll() {
    await Promise.all([this.readHeld(), this.#reads.read("jobs", () => this.jobs.readAll())]);
  }

  readHeld() {
    return this.#reads.read("held", async () => {
      this.held = /** @type {StillDocument[]} */ (await request("GET", "/stills?state=held"));
      this.changed();
    });
  }

  /** @param {EventDocument} event */
  onEvent(event) {
    if (event.kind.startsWith("still.")) void this.readHeld();
    this.jobs.onEvent(event);
  }

  /** @param {Job} job */
  #take(job) {
    this.changed();
    if (hasEnded(job.state)) void this.readHeld();
    const path = resultPath(job);
    if (path) void this.#reads.read("taken", async () => this.taken(await request("GET", path)));
  }
}
