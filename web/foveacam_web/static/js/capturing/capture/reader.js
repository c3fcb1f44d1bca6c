// Follows the running capture of any client on every page; reads the list of captures while the capture page is
// open.

import { RequestError, request } from "../../transport/api.js";
import { hasEnded, JobFollower } from "../../transport/jobs.js";
import { QuietReads } from "../../transport/quiet.js";
import { isCapturing } from "./state.js";

/**
 * @import { CaptureDocument, CaptureProgress, EventDocument, JobDocument } from "#api"
 * @import { Capturing, Commands, Job, Store } from "#console"
 */

/** The capture reads of one page. */
export class CaptureReader {
  #store;
  #reads = new QuietReads();
  #jobs = new JobFollower({ ours: ({ kind }) => kind === "capture", news: (job) => this.#take(job) });
  /** Called when a capture has ended. */
  ended = () => {};

  /** @param {Store} store */
  constructor(store) {
    this.#store = store;
    store.on(["capture_page"], ({ capture_page }) => capture_page && void this.readList());
  }

  async readAll() {
    await Promise.all([
      this.#reads.read("what runs", () => this.#jobs.readAll()),
      this.#readDocument(),
      this.#store.state.capture_page && this.readList(),
    ]);
  }

  readList() {
    return this.#reads.keep(this.#store, "captures", "/captures");
  }

  /**
   * Follow a capture's job from now on.
   * @param {JobDocument} job
   * @param {{name: string, capture_id?: string | null}} known
   */
  follow(job, known) {
    this.#begin(job.id, known);
    this.#jobs.follow(job);
  }

  /** Cancel the capture; its points stay on the disk. @param {Commands} commands */
  cancel(commands) {
    return this.#jobs.cancel(commands);
  }

  /** @param {string} job_id @param {{name?: string, capture_id?: string | null}} [known] */
  #begin(job_id, { name = "", capture_id = null } = {}) {
    this.#set({ job_id, capture_id, name, state: "starting", progress: null, why: "", asked: null, end: null });
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
  onEvent(event) {
    const data = event.data ?? {};
    this.#jobs.onEvent(event);
    // any: the data of this event kind, which OpenAPI leaves open
    if (event.kind === "capture.progress") this.#progress(/** @type {any} */ (data));
    if (/^capture\.(created|ended|updated|removed)$/.test(event.kind) && this.#store.state.capture_page)
      void this.readList();
  }

  /** @param {CaptureProgress & {capture_id: string, job_id: string, state: "running" | "paused", wish: string}} data */
  #progress({ capture_id, job_id, state, wish, ...progress }) {
    const { capturing } = this.#store.state;
    if (capturing?.job_id !== job_id && isCapturing(capturing)) return;
    if (capturing?.job_id === job_id && capturing.end) return; // a late event
    if (capturing?.job_id !== job_id) this.#begin(job_id, { capture_id });
    this.#jobs.expect(job_id);
    this.#show({ capture_id, state, progress, why: wish });
  }

  /** @param {Job} job */
  #take({ id, kind, state }) {
    if (!kind) return this.#store.set({ capturing: null }); // the server has another data directory, without this job
    if (this.#store.state.capturing?.job_id !== id) this.#begin(id);
    const { events_link, capturing } = this.#store.state;
    if (hasEnded(state) || events_link !== "open" || !capturing?.progress) void this.#readDocument(); // else events tell
  }

  /** Read how far the capture is, or how it ended. */
  #readDocument() {
    return this.#reads.read("document", async () => {
      const { capturing } = this.#store.state;
      if (!capturing || capturing.end) return;
      const { job_id } = capturing;
      const { job } = this.#jobs; // as it was before its document is read
      const found = await this.#document(capturing);
      if (this.#store.state.capturing?.job_id !== job_id) return;
      if (job?.id === job_id && hasEnded(job.state)) this.#close(job, found);
      else if (found?.job_id === job_id)
        this.#show({
          capture_id: found.id,
          name: found.name,
          state: found.state,
          progress: found.progress,
          why: found.why,
        });
    });
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

  /** @param {Job} job that has ended @param {CaptureDocument | null} found */
  #close(job, found) {
    const { capturing } = this.#store.state;
    if (!capturing || capturing.end) return;
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
  #show(news) {
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
