// Follows the running capture on every page, whoever started it; reads the list of captures while the capture page is
// open.

import { RequestError, request } from "../../transport/api.js";
import { QuietReads } from "../../transport/quiet.js";
import { isCapturing } from "./state.js";

/**
 * @import { CaptureDocument, CaptureProgress, EventDocument, JobDocument } from "#api"
 * @import { Capturing } from "#page"
 * @import { Store } from "../../store.js"
 */

const LOOK_MS = 1000; // interval of reading the job, in case its events do not arrive

/** The capture reads of one page. */
export class CaptureReader {
  #store;
  #reads = new QuietReads();
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  #look;
  /** Called when a capture has ended. */
  ended = () => {};

  /** @param {Store} store */
  constructor(store) {
    this.#store = store;
    store.on(["capture_page"], ({ capture_page }) => capture_page && void this.readList());
  }

  async readAll() {
    await Promise.all([
      this.#reads.read("what runs", () => this.#find()),
      this.#store.state.capture_page && this.readList(),
    ]);
  }

  readList() {
    return this.#reads.read("captures", async () => {
      this.#store.set({ captures: /** @type {CaptureDocument[]} */ (await request("GET", "/captures")) });
    });
  }

  /**
   * Follow a capture's job from now on.
   * @param {string} job_id
   * @param {{name?: string, capture_id?: string | null}} [known]
   */
  follow(job_id, { name = "", capture_id = null } = {}) {
    this.#set({ job_id, capture_id, name, state: "starting", progress: null, why: "", asked: null, end: null });
    this.#watch();
  }

  /**
   * Note the command sent to the running capture; it is cleared when it has taken effect or was refused.
   * @param {Capturing["asked"]} asked
   */
  mark(asked) {
    const { capturing } = this.#store.state;
    if (capturing && isCapturing(capturing)) this.#set({ ...capturing, asked });
  }

  /** Clear the result of the last capture. */
  dismiss() {
    if (!isCapturing(this.#store.state.capturing)) this.#store.set({ capturing: null });
  }

  /** @param {EventDocument} event */
  hear(event) {
    const data = event.data ?? {};
    // any: the data of this event kind, which OpenAPI leaves open
    if (event.kind === "capture.progress") this.#progress(/** @type {any} */ (data));
    if (event.kind === "job.updated") this.#job(/** @type {JobDocument} */ (data["job"] ?? data));
    if (/^capture\.(created|ended|updated|removed)$/.test(event.kind) && this.#store.state.capture_page)
      void this.readList();
  }

  /** @param {CaptureProgress & {capture_id: string, job_id: string, state: "running" | "paused", wish: string}} data */
  #progress({ capture_id, job_id, state, wish, ...progress }) {
    const { capturing } = this.#store.state;
    if (capturing?.job_id !== job_id && isCapturing(capturing)) return;
    if (capturing?.job_id === job_id && capturing.end) return; // a late event
    if (capturing?.job_id !== job_id) this.follow(job_id, { capture_id });
    this.#take({ capture_id, state, progress, why: wish });
  }

  /** @param {JobDocument} job */
  #job(job) {
    const { capturing } = this.#store.state;
    if (job.kind !== "capture") return;
    if (capturing?.job_id === job.id) {
      if (job.ended_utc !== null && isCapturing(capturing)) void this.#lookUp();
    } else if (!isCapturing(capturing) && job.ended_utc === null) this.follow(job.id);
  }

  /** Read which capture runs, after the page has opened or the server has come back. */
  async #find() {
    if (isCapturing(this.#store.state.capturing)) return this.#lookUp();
    const jobs = /** @type {JobDocument[]} */ (await request("GET", "/jobs?limit=20"));
    const job = jobs.find(({ kind, ended_utc }) => kind === "capture" && ended_utc === null);
    if (job && !isCapturing(this.#store.state.capturing)) this.follow(job.id);
    if (job) await this.#lookUp();
  }

  #watch() {
    clearTimeout(this.#look);
    this.#look = setTimeout(() => void this.#lookUp(), LOOK_MS);
  }

  async #lookUp() {
    const { capturing } = this.#store.state;
    if (!capturing || capturing.end) return;
    try {
      const found = await this.#document(capturing);
      const job =
        found?.job_id === capturing.job_id
          ? null
          : /** @type {JobDocument} */ (await request("GET", `/jobs/${capturing.job_id}`));
      if (this.#store.state.capturing?.job_id !== capturing.job_id) return;
      if (job && job.ended_utc !== null) return this.#close(job, found);
      if (found && !job)
        this.#take({
          capture_id: found.id,
          name: found.name,
          state: found.state,
          progress: found.progress,
          why: found.why,
        });
      this.#watch();
    } catch (error) {
      if (!(error instanceof RequestError)) throw error;
      if (error.slug === "not-found")
        this.#store.set({ capturing: null }); // the server has another data directory, without this job
      else this.#watch();
    }
  }

  /** Return the capture's document; null while it does not exist. @param {Capturing} capturing */
  async #document({ capture_id, job_id }) {
    const captures = /** @type {CaptureDocument[]} */ (
      capture_id === null
        ? await request("GET", "/captures")
        : await request("GET", `/captures/${capture_id}`).then((one) => [one], nothingThere)
    );
    return captures.find((each) => each.id === capture_id || each.job_id === job_id) ?? null;
  }

  /** @param {JobDocument} job that has ended @param {CaptureDocument | null} found */
  #close(job, found) {
    const { capturing } = this.#store.state;
    if (!capturing || capturing.end) return;
    clearTimeout(this.#look);
    this.#set({
      ...capturing,
      asked: null,
      name: found?.name ?? capturing.name,
      end: {
        job: job.state,
        state: found?.state ?? null,
        why: found?.why ?? "",
        problem: job.problem,
        taken: found?.points.taken ?? 0,
        planned: found?.points.planned ?? 0,
        resumable: found?.resumable ?? false,
      },
    });
    this.ended();
    if (this.#store.state.capture_page) void this.readList();
  }

  /** @param {Partial<Capturing> & Pick<Capturing, "state">} news */
  #take(news) {
    const { capturing } = this.#store.state;
    if (!capturing || capturing.end) return;
    const come =
      (capturing.asked === "pause" && news.state === "paused") ||
      (capturing.asked === "continue" && news.state !== "paused");
    this.#set({ ...capturing, ...news, asked: come ? null : capturing.asked });
  }

  /** @param {Capturing} capturing */
  #set(capturing) {
    this.#store.set({ capturing });
  }
}

/** @param {unknown} error @returns {CaptureDocument[]} */
function nothingThere(error) {
  if (error instanceof RequestError && error.slug === "not-found") return [];
  throw error;
}
