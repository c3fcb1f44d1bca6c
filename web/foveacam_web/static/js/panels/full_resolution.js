// Orders one more look at full resolution for the cloud of a fixation, and follows its job until it ends.

import { basisOf } from "../looking/answers.js";
import { outcome, request } from "../transport/api.js";
import { JobFollower, resultPath } from "../transport/jobs.js";

/**
 * @import { CloudDocument, FixationDocument, JobDocument } from "#api"
 * @import { Commands, ConsoleState, FullLook, Job, Store } from "#console"
 * @import { Fixations } from "../looking/fixations.js"
 */

/**
 * Return the size that one more look would have in place of the smaller one of a fixation's cloud; null where it would
 * not have more pixels, no pair of foveae sees the target, or the rig's sizes are not known.
 * @param {Pick<ConsoleState, "rig" | "clouds">} state
 * @param {FixationDocument} fixation
 * @returns {{width: number, height: number} | null}
 */
export function largerLook({ rig, clouds }, fixation) {
  const basis = basisOf(fixation);
  if (rig?.binning?.working_binning !== 2 || (basis !== "both_foveae" && basis !== "surroundings")) return null;
  const sensor = rig.cameras.find(({ role }) => role === "left");
  if (!sensor?.width || !sensor.height) return null;
  const cloud = clouds.find(({ id }) => id === fixation.cloud_id);
  if (cloud?.depth_width != null && cloud.depth_width >= sensor.width) return null;
  return { width: sensor.width, height: sensor.height };
}

/** The looks at full resolution that one page orders. */
export class FullResolution {
  #store;
  #commands;
  #fixations;
  /** Follows the look's job; the server's events have to be passed to it. */
  jobs = new JobFollower({ news: (job) => this.#take(job) });

  /** @param {{store: Store, commands: Commands, fixations: Fixations}} context */
  constructor({ store, commands, fixations }) {
    this.#store = store;
    this.#commands = commands;
    this.#fixations = fixations;
  }

  /** Look once more, for the cloud. @param {string} fixation_id */
  async look(fixation_id) {
    this.jobs.forget();
    this.#store.set({ full_look: { fixation_id, job_id: null, state: "sending", note: "", problem: null } });
    const path = `/fixations/${fixation_id}/full_resolution`;
    const job = /** @type {JobDocument | null} */ (await this.#commands.send("POST", path));
    if (!job) this.#store.set({ full_look: null });
    else this.jobs.follow(job);
  }

  cancel() {
    return this.jobs.cancel(this.#commands);
  }

  /** @param {Job} job */
  #take(job) {
    const { id, state, problem, progress } = job;
    const path = resultPath(job);
    const { full_look } = this.#store.state;
    if (path && full_look) void this.#show(full_look.fixation_id, path);
    else if (state === "cancelled") this.#store.set({ full_look: null });
    else this.#change({ job_id: id, state, note: progress?.note ?? "", problem });
  }

  /** @param {Partial<FullLook>} change */
  #change(change) {
    const { full_look } = this.#store.state;
    if (full_look) this.#store.set({ full_look: { ...full_look, ...change } });
  }

  /** Show the new cloud with its fixation. @param {string} fixation_id @param {string} path */
  async #show(fixation_id, path) {
    const { answer: cloud, error } = await outcome(/** @type {Promise<CloudDocument>} */ (request("GET", path)));
    if (error) return this.#change({ state: "failed", problem: error.document });
    const { clouds, current } = this.#store.state;
    this.#store.set({ full_look: null, clouds: [cloud, ...clouds.filter(({ id }) => id !== cloud.id)] });
    if (current?.fixation?.id === fixation_id) this.#fixations.changed({ ...current.fixation, cloud_id: cloud.id });
  }
}
