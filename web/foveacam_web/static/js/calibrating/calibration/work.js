// Follows the running calibration procedure, whoever started it: its progress, time left and result.

import { request } from "../../transport/api.js";
import { hasEnded, JobWatch } from "../../transport/jobs.js";
import { isRunning } from "./state.js";

/**
 * @import { EventDocument, JobDocument, Problem } from "#api"
 * @import { Work } from "#page"
 * @import { Store } from "../../store.js"
 */

const LOOK_MS = 1000; // interval of reading the job: for the time left, and in case its events do not arrive

/** Follows the procedure for one page. */
export class WorkFollower {
  #store;
  #watch = new JobWatch({
    every_ms: LOOK_MS,
    found: (job) => this.#take(job),
    lost: (problem) => this.#lost(problem),
  });
  /** Called when the procedure has ended. @type {() => void} */
  ended = () => {};

  /** @param {Store} store */
  constructor(store) {
    this.#store = store;
  }

  /**
   * @param {JobDocument} job
   * @param {{step: Work["step"], session_id: string | null, options?: Work["options"]}} what
   */
  follow(job, { step, session_id, options = null }) {
    this.#set({
      job_id: job.id,
      session_id,
      step,
      stage: step,
      state: "queued",
      done: 0,
      total: null,
      eta_s: null,
      note: "",
      problem: null,
      options,
    });
    this.#take(job);
  }

  /** Read which procedure runs, after the page has opened or the server has come back. */
  async resume() {
    const { work } = this.#store.state;
    if (work && isRunning(work)) return this.#watch.read(work.job_id);
    const jobs = /** @type {JobDocument[]} */ (await request("GET", "/jobs?limit=20"));
    const job = jobs.find(isOurs);
    if (!job || job.id === this.#store.state.work?.job_id) return; // an event or a command of this page came first
    this.follow(job, { step: stepOf(job.kind), session_id: null });
  }

  /** Store the session of the procedure when it becomes known. @param {string} session_id */
  place(session_id) {
    const { work } = this.#store.state;
    if (work && work.session_id === null) this.#set({ ...work, session_id });
  }

  /** Clear the result of the last procedure. */
  dismiss() {
    if (!isRunning(this.#store.state.work)) this.#store.set({ work: null });
  }

  /** @param {EventDocument} event */
  hear(event) {
    const data = event.data ?? {};
    const { work } = this.#store.state;
    if (event.kind === "calibration.progress") this.#progress(data);
    if (event.kind !== "job.updated") return;
    const job = /** @type {JobDocument} */ (data["job"] ?? data);
    if (work && job.id === work.job_id) this.#take(job);
    else if (!isRunning(work) && isOurs(job)) {
      this.follow(job, { step: stepOf(job.kind), session_id: null });
    }
  }

  /** @param {Record<string, unknown>} data */
  #progress(data) {
    const { work } = this.#store.state;
    if (!work || !isRunning(work) || (work.session_id && work.session_id !== data["session_id"])) return;
    this.#set({
      ...work,
      session_id: work.session_id ?? text(data["session_id"]),
      stage: text(data["step"]) ?? work.stage,
      done: typeof data["done"] === "number" ? data["done"] : work.done,
      total: typeof data["total"] === "number" ? data["total"] : work.total,
      note: text(data["note"]) ?? "",
    });
  }

  /** @param {JobDocument} job */
  #take(job) {
    const { work } = this.#store.state;
    if (!work || work.job_id !== job.id || !isRunning(work)) return;
    const { progress } = job;
    this.#set({
      ...work,
      state: job.state,
      problem: job.problem,
      eta_s: progress?.eta_s ?? null,
      done: progress?.done ?? work.done,
      total: progress?.total ?? work.total,
      note: progress?.note ?? work.note,
    });
    if (hasEnded(job.state)) this.ended();
    else this.#watch.watch(job.id);
  }

  /** @param {Problem} problem */
  #lost(problem) {
    const { work } = this.#store.state;
    if (work && isRunning(work)) this.#set({ ...work, state: "failed", problem });
  }

  /** @param {Work} work */
  #set(work) {
    this.#store.set({ work });
  }
}

/** Return whether a job is a calibration procedure that has not ended. @param {JobDocument} job */
function isOurs({ kind, ended_utc }) {
  return /^(calibration\.|drift)/.test(String(kind)) && ended_utc === null;
}

/** @param {string} kind of the job, such as "calibration.mirrors" @returns {Work["step"]} */
function stepOf(kind) {
  const steps = /** @type {Work["step"][]} */ (["wide", "mirrors", "fit", "check", "settle", "drift"]);
  return steps.find((step) => kind.includes(step)) ?? "all";
}

/** @param {unknown} value */
function text(value) {
  return typeof value === "string" ? value : null;
}
