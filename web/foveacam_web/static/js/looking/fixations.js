// Follows the running fixation of any client: its steps by events, its result at the end.

import { outcome, request } from "../transport/api.js";
import { hasEnded, JobFollower, resultPath } from "../transport/jobs.js";

/**
 * @import { EventDocument, FixationDocument, FixationEstimate, FixationRequest, JobDocument } from "#api"
 * @import { Problem, StepDocument } from "#api"
 * @import { CurrentFixation, Job, Store } from "#console"
 */

const REQUESTS = 8; // the newest orders of this page whose requests are kept

/** The fixation tracker of one page. */
export class Fixations {
  #store;
  #jobs = new JobFollower({ news: (job) => this.#take(job) });
  /** @type {CurrentFixation | null} what was shown before the request that is being sent */
  #before = null;

  /** @type {Map<string, FixationRequest | null>} the requests of this page by job, oldest first */
  #requests = new Map();

  /** @param {Store} store */
  constructor(store) {
    this.#store = store;
  }

  get running() {
    const state = this.#store.state.current?.state;
    return state !== undefined && !hasEnded(state);
  }

  /** @param {FixationRequest | null} request_body */
  sending(request_body) {
    if (this.running) return; // it queues behind the running one, which stays visible
    this.#before = this.#store.state.current;
    this.#set({ ...fresh(null, request_body, true), state: "sending" });
  }

  /** @param {JobDocument} job @param {FixationRequest | null} request_body @param {boolean} mine */
  follow(job, request_body, mine) {
    if (mine) this.#remember(job.id, request_body);
    const current = this.#store.state.current;
    // its events may have arrived before the response
    const known = current?.job_id === job.id ? current : fresh(job.id, null, mine);
    this.#set({ ...known, request: request_body, mine });
    this.#jobs.follow(job);
  }

  /** Show the previous fixation again: the request was refused. */
  refused() {
    if (this.#store.state.current?.state === "sending") this.#store.set({ current: this.#before });
  }

  /** @param {EventDocument} event */
  onEvent(event) {
    const data = event.data ?? {};
    this.#jobs.onEvent(event);
    if (event.kind === "fixation.step") this.#step(data);
    else if (event.kind === "fixation.estimate")
      this.#estimate(/** @type {FixationEstimate} */ (/** @type {unknown} */ (data)));
    else if (event.kind === "fixation.done")
      this.#ended(/** @type {FixationDocument} */ (data)); // the event carries the whole fixation
    else if (event.kind === "fixation.updated")
      this.changed(/** @type {FixationDocument} */ (/** @type {unknown} */ (data)));
    else if (event.kind === "cloud.created") this.#cloud(data);
    else if (event.kind === "fixation.selected" && typeof data["fixation_id"] === "string")
      void this.recall(data["fixation_id"]);
  }

  /** Read which fixation runs, or else the last one, after the page has opened or the server has come back. */
  async resume() {
    if (this.#jobs.running) await this.#jobs.readAll();
    if (this.#store.state.current) return;
    const [runs, recent] = await Promise.all([
      /** @type {Promise<FixationEstimate[]>} */ (request("GET", "/fixations/estimates")),
      /** @type {Promise<FixationDocument[]>} */ (request("GET", "/fixations?limit=1")),
    ]);
    const last = recent[0];
    if (runs[0]) this.#estimate(runs[0]);
    else if (last && !this.#store.state.current)
      this.#set({ ...fresh(last.job_id, last.request, false), state: "succeeded", steps: last.steps, fixation: last });
  }

  /** Show an earlier fixation, unless it was deleted meanwhile or another one runs. @param {string} fixation_id */
  async recall(fixation_id) {
    if (this.running) return;
    const asked = /** @type {Promise<FixationDocument>} */ (request("GET", `/fixations/${fixation_id}`));
    const { answer: past } = await outcome(asked);
    if (this.running || !past) return;
    this.#set({ ...fresh(past.job_id, past.request, false), state: "succeeded", steps: past.steps, fixation: past });
    const target = this.#store.state.targets?.find((known) => known.fixation_id === fixation_id);
    if (target) this.#store.set({ selected_target: target.id });
  }

  /** Show the new answer of a fixation after the operator has chosen one. @param {FixationDocument} fixation */
  changed(fixation) {
    const current = this.#store.state.current;
    if (current?.fixation?.id === fixation.id) this.#set({ ...current, fixation });
  }

  /** @param {Record<string, unknown>} data */
  #step(data) {
    const job_id = typeof data["job_id"] === "string" ? data["job_id"] : null;
    const step = /** @type {StepDocument} */ (data["step"] ?? data);
    if (typeof step.index !== "number") return;
    const current = this.#runningOf(job_id);
    if (!current) return;
    const steps = [...current.steps.filter(({ index }) => index !== step.index), step].sort(
      (a, b) => a.index - b.index,
    );
    this.#set({ ...current, state: current.state === "cancelling" ? "cancelling" : "running", steps });
    if (current.job_id) this.#jobs.expect(current.job_id);
  }

  /** Show what is known of the distance so far. @param {FixationEstimate} estimate */
  #estimate(estimate) {
    const current = this.#runningOf(estimate.job_id);
    if (!current || hasEnded(current.state)) return;
    this.#set({ ...current, state: current.state === "cancelling" ? "cancelling" : "running", estimate });
    this.#jobs.expect(estimate.job_id);
  }

  /**
   * Return the fixation of a job that runs; null when its result was read before the event of it came.
   * @param {string | null} job_id
   */
  #runningOf(job_id) {
    const current = this.#store.state.current;
    if (current?.fixation && current.job_id === job_id) return null;
    if (current && (!job_id || current.job_id === job_id)) return current;
    const asked = (job_id && this.#requests.get(job_id)) || (current?.state === "sending" ? current.request : null);
    const mine = job_id !== null && this.#requests.has(job_id);
    return { ...fresh(job_id, asked, mine), state: /** @type {const} */ ("running") };
  }

  /** @param {string} job_id @param {FixationRequest | null} request_body */
  #remember(job_id, request_body) {
    this.#requests.set(job_id, request_body);
    const oldest = this.#requests.keys().next().value;
    if (this.#requests.size > REQUESTS && oldest) this.#requests.delete(oldest);
  }

  /** Add the cloud to the shown fixation; it arrives a moment later. @param {Record<string, unknown>} data */
  #cloud(data) {
    const current = this.#store.state.current;
    const cloud_id = data["id"];
    if (!current?.fixation || current.fixation.id !== data["fixation_id"] || typeof cloud_id !== "string") return;
    this.#set({ ...current, fixation: { ...current.fixation, cloud_id } });
  }

  /** @param {Job} job */
  #take(job) {
    const current = this.#store.state.current;
    if (!current || current.job_id !== job.id || current.fixation) return;
    const path = resultPath(job);
    if (path) void this.#load(path);
    else this.#set({ ...current, state: job.state, problem: job.problem, note: job.progress?.note ?? null });
  }

  /** @param {Problem} problem */
  #fail(problem) {
    const current = this.#store.state.current;
    if (current) this.#set({ ...current, state: "failed", problem });
  }

  /** @param {string} path */
  async #load(path) {
    const { answer, error } = await outcome(/** @type {Promise<FixationDocument>} */ (request("GET", path)));
    if (answer) this.#ended(answer);
    else this.#fail(error.document);
  }

  /** @param {FixationDocument} fixation */
  #ended(fixation) {
    const current = this.#store.state.current ?? fresh(fixation.job_id, fixation.request, false);
    if (current.job_id !== fixation.job_id) return; // another fixation has begun meanwhile
    this.#jobs.forget();
    this.#set({ ...current, state: "succeeded", steps: fixation.steps, fixation, problem: null });
  }

  /** @param {CurrentFixation} current */
  #set(current) {
    this.#store.set({ current });
  }
}

/**
 * @param {string | null} job_id
 * @param {FixationRequest | null} request_body
 * @param {boolean} mine
 * @returns {CurrentFixation}
 */
function fresh(job_id, request_body, mine) {
  return {
    job_id,
    request: request_body,
    state: "queued",
    steps: [],
    estimate: null,
    note: null,
    fixation: null,
    problem: null,
    mine,
  };
}
