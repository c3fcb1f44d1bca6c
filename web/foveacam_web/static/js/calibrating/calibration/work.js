// Follows the running calibration procedure of any client: progress, time left and result.

import { hasEnded, JobFollower } from "../../transport/jobs.js";
import { isRunning } from "./state.js";

/**
 * @import { EventDocument, JobDocument } from "#api"
 * @import { Commands, Job, Store, Work } from "#console"
 */

/** Follows the procedure for one page. */
export class WorkFollower {
  #store;
  #jobs = new JobFollower({
    ours: ({ kind }) => /^(calibration\.|drift|acceptance$)/.test(kind),
    news: (job) => this.#take(job),
  });
  /** Called when the procedure has ended. @type {() => void} */
  ended = () => {};

  /** @param {Store} store */
  constructor(store) {
    this.#store = store;
  }

  /**
   * @param {JobDocument} job
   * @param {Pick<Work, "step" | "session_id" | "options">} what
   */
  follow(job, what) {
    this.#store.set({ work: fresh(job.id, what) });
    this.#jobs.follow(job);
  }

  /** Read which procedure runs, after the page has opened or the server has come back. */
  resume() {
    return this.#jobs.readAll();
  }

  /** Cancel the procedure; its measurements are kept. @param {Commands} commands */
  cancel(commands) {
    return this.#jobs.cancel(commands);
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
  onEvent(event) {
    if (event.kind === "calibration.progress") this.#progress(event.data ?? {});
    this.#jobs.onEvent(event);
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

  /** @param {Job} job */
  #take({ id, kind = "", state, problem, progress }) {
    const known = this.#store.state.work;
    const work = known?.job_id === id ? known : fresh(id, { step: stepOf(kind), session_id: null, options: null });
    this.#set({
      ...work,
      state,
      problem,
      eta_s: progress?.eta_s ?? null,
      done: progress?.done ?? work.done,
      total: progress?.total ?? work.total,
      note: progress?.note ?? work.note,
    });
    if (hasEnded(state)) this.ended();
  }

  /** @param {Work} work */
  #set(work) {
    this.#store.set({ work });
  }
}

/** @param {string} job_id @param {Pick<Work, "step" | "session_id" | "options">} what @returns {Work} */
function fresh(job_id, what) {
  const progress = { done: 0, total: null, eta_s: null, note: "" };
  return { job_id, ...what, ...progress, stage: what.step, state: "queued", problem: null };
}

/** @param {string} kind of the job, such as "calibration.mirrors" @returns {Work["step"]} */
function stepOf(kind) {
  const steps = /** @type {Work["step"][]} */ (["wide", "mirrors", "fit", "check", "settle", "drift", "acceptance"]);
  return steps.find((step) => kind.includes(step)) ?? "all";
}

/** @param {unknown} value */
function text(value) {
  return typeof value === "string" ? value : null;
}
