// Follows a job of the server until it ends: by its events, and by reading it where they do not arrive.

import { outcome, request } from "./api.js";

/**
 * @import { EventDocument, JobDocument } from "#api"
 * @import { Commands, Job } from "#console"
 */

const LOOK_MS = 700; // without an event for so long, the job is read
const GONE = 404; // the server has another data directory, or has dropped the job

/** @param {string} state of a job */
export function hasEnded(state) {
  return state === "cancelled" || state === "failed" || state === "succeeded";
}

/** Return the path below /api/v1 of what a job has made; null where it has made nothing. @param {Job} job */
export function resultPath({ state, result_url }) {
  return state === "succeeded" && result_url ? result_url.replace(/^.*\/api\/v1/, "") : null;
}

/** Follows one job at a time. */
export class JobFollower {
  #news;
  #ours;
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  #timer;
  /** The id of the job that is followed, or was last. @type {string | null} */
  id = null;
  /** That job as it was last read or heard; null before. @type {Job | null} */
  job = null;

  /**
   * @param {{news: (job: Job) => unknown, ours?: (job: JobDocument) => boolean}} context
   *   `news`: called with each state of the job up to its end; one that the server does not know any more has failed,
   *   with the server's refusal as its problem; `ours`: which jobs are followed though this page has not started them
   */
  constructor({ news, ours }) {
    this.#news = news;
    this.#ours = ours;
  }

  get running() {
    return this.id !== null && !(this.job && hasEnded(this.job.state));
  }

  /** Follow a job from now on; its news comes at once. @param {JobDocument} job perhaps older than what was heard */
  follow(job) {
    this.expect(job.id);
    if (this.running) this.#take(job);
    else if (this.job) this.#news(this.job);
  }

  /** Follow a job of which only the id is known so far. @param {string} id */
  expect(id) {
    if (id !== this.id) [this.id, this.job] = [id, null];
    this.#readLater();
  }

  /** Follow nothing any more. */
  forget() {
    clearTimeout(this.#timer);
    this.id = this.job = null;
  }

  /** Read the job, or look for one of ours that runs, after the page has opened or the server has come back. */
  async readAll() {
    if (this.running) return this.#read();
    if (!this.#ours) return;
    const jobs = /** @type {JobDocument[]} */ (await request("GET", "/jobs?limit=20"));
    const job = jobs.find((each) => this.#isOurs(each));
    if (job && !this.running && job.id !== this.id) this.follow(job); // else an event or a command came first
  }

  /** @param {EventDocument} event */
  onEvent({ kind, data }) {
    if (kind !== "job.updated") return;
    const job = /** @type {JobDocument} */ (/** @type {unknown} */ (data));
    if (job.id === this.id) this.#take(job);
    else if (!this.running && this.#isOurs(job)) this.follow(job);
  }

  /** Cancel the job; return null where it was refused or nothing runs. @param {Pick<Commands, "send">} commands */
  async cancel(commands) {
    if (!this.running) return null;
    const job = /** @type {JobDocument | null} */ (await commands.send("POST", `/jobs/${this.id}/cancel`));
    if (job?.id === this.id) this.#take(job);
    return job;
  }

  /** @param {JobDocument} job */
  #isOurs(job) {
    return this.#ours !== undefined && this.#ours(job) && !hasEnded(job.state);
  }

  /** @param {Job} job */
  #take(job) {
    if (!this.running) return; // a late answer
    this.job = job;
    this.#readLater();
    this.#news(job);
  }

  #readLater() {
    clearTimeout(this.#timer);
    if (this.running) this.#timer = setTimeout(() => void this.#read(), LOOK_MS);
  }

  async #read() {
    const id = /** @type {string} */ (this.id);
    const { answer, error } = await outcome(/** @type {Promise<JobDocument>} */ (request("GET", `/jobs/${id}`)));
    if (id !== this.id) return; // another job is followed meanwhile
    if (answer) this.#take(answer);
    else if (error.document.status === GONE) this.#take({ id, state: "failed", problem: error.document });
    else this.#readLater(); // the server is away, opens its rig, or does not know this browser
  }
}
