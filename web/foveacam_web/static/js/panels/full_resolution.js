// Orders one more look at full resolution for the cloud of a fixation, and follows its job until it ends.

import { basisOf } from "../looking/answers.js";
import { RequestError, request } from "../transport/api.js";
import { hasEnded, JobWatch } from "../transport/jobs.js";

/**
 * @import { CloudDocument, FixationDocument, JobDocument, Problem } from "#api"
 * @import { ConsoleState } from "#page"
 * @import { Commands } from "../commands.js"
 * @import { Fixations } from "../looking/fixations.js"
 * @import { Store } from "../store.js"
 */

const LOOK_MS = 300;

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
  #watch = new JobWatch({
    every_ms: LOOK_MS,
    found: (job) => this.#take(job),
    lost: (problem) => this.#fail(problem),
  });

  /** @param {{store: Store, commands: Commands, fixations: Fixations}} context */
  constructor({ store, commands, fixations }) {
    this.#store = store;
    this.#commands = commands;
    this.#fixations = fixations;
  }

  /** Look once more, for the cloud. @param {string} fixation_id */
  async look(fixation_id) {
    this.#store.set({
      full_look: { fixation_id, job_id: null, state: "sending", note: "", problem: null },
    });
    const path = `/fixations/${fixation_id}/full_resolution`;
    const job = /** @type {JobDocument | null} */ (await this.#commands.send("POST", path));
    if (!job) this.#store.set({ full_look: null });
    else this.#take(job);
  }

  cancel() {
    const job_id = this.#store.state.full_look?.job_id;
    return job_id ? this.#commands.send("POST", `/jobs/${job_id}/cancel`) : Promise.resolve(null);
  }

  /** @param {JobDocument} job */
  #take(job) {
    const { full_look } = this.#store.state;
    if (!full_look || (full_look.job_id !== null && full_look.job_id !== job.id)) return;
    const { state, problem, progress } = job;
    if (state === "succeeded" && job.result_url) {
      void this.#show(full_look.fixation_id, job.result_url.replace(/^.*\/api\/v1/, ""));
      return;
    }
    const next = {
      ...full_look,
      job_id: job.id,
      state,
      note: progress?.note ?? "",
      problem,
    };
    this.#store.set({ full_look: state === "cancelled" ? null : next });
    if (!hasEnded(state)) this.#watch.watch(job.id);
  }

  /** @param {Problem} problem */
  #fail(problem) {
    const { full_look } = this.#store.state;
    if (full_look)
      this.#store.set({
        full_look: { ...full_look, state: "failed", problem },
      });
  }

  /** Show the new cloud with its fixation. @param {string} fixation_id @param {string} path */
  async #show(fixation_id, path) {
    try {
      const cloud = /** @type {CloudDocument} */ (await request("GET", path));
      const { clouds, current } = this.#store.state;
      this.#store.set({
        full_look: null,
        clouds: [cloud, ...clouds.filter(({ id }) => id !== cloud.id)],
      });
      if (current?.fixation?.id === fixation_id) this.#fixations.changed({ ...current.fixation, cloud_id: cloud.id });
    } catch (error) {
      if (!(error instanceof RequestError)) throw error;
      this.#fail(error.document);
    }
  }
}
