// Products that the server makes of a dataset (mosaic, reference): reads, commands, and the progress shown.

import { hasEnded, JobFollower } from "../../transport/jobs.js";
import { jobRow, shareOf, toolButton } from "../../elements/parts.js";
import { html } from "../../elements/dom.js";
import { sentence, timeLeft } from "../../elements/format.js";
import { icon } from "../../elements/icons.js";
import { EntryReader } from "./collection_readers.js";
import { capturePath } from "./dataset_words.js";

/**
 * @import { EventDocument, Problem } from "#api"
 * @import { Commands, Job, MakingDocument } from "#console"
 */

/**
 * A mosaic or a reference of one dataset: follows the job that makes it, starts, cancels and removes it.
 * @template {MakingDocument} T
 * @template W the request model
 * @extends {EntryReader<T>}
 */
export class Made extends EntryReader {
  /** The problem of the last attempt to make it. @type {Problem | null} */
  trouble = null;
  jobs = new JobFollower({ news: (job) => this.#take(job) });

  /** @param {string} id of the dataset @param {"mosaic" | "reference"} kind @param {Commands} commands */
  constructor(id, kind, commands) {
    super(capturePath(id, `/${kind}`), (event) => {
      const [of, what] = event.kind.split(".");
      return event.data?.["capture_id"] === id && (of === kind || (of === "capture" && what !== "progress"));
    });
    this.path = capturePath(id, `/${kind}`);
    this.kind = kind;
    this.commands = commands;
  }

  /** @override @param {T} made */
  async readMore({ job_id }) {
    if (job_id !== null) this.jobs.expect(job_id);
    else if (this.jobs.running) await this.jobs.readAll(); // its end was not heard of
  }

  /** @param {Job} job */
  #take({ state, problem }) {
    if (hasEnded(state)) {
      this.trouble = state === "failed" ? problem : null;
      void this.readAll();
    }
    this.changed();
  }

  /** Leave it: the page is closed. */
  forget() {
    this.jobs.forget();
  }

  /** Clear the problem of the last attempt. */
  dismiss() {
    this.trouble = null;
    this.changed();
  }

  /** @override @param {EventDocument} event */
  onEvent(event) {
    this.jobs.onEvent(event);
    super.onEvent(event);
  }

  /** @param {W} wish */
  make(wish) {
    this.dismiss();
    return this.#send("POST", this.path, wish);
  }

  remove() {
    return this.#send("DELETE", this.path);
  }

  /** @param {"POST" | "DELETE"} method @param {string} path @param {W} [body] */
  async #send(method, path, body) {
    await this.commands.send(method, path, { body });
    await this.readAll();
  }

  /**
   * Show the making: why the last attempt failed, why it cannot be made, its progress.
   * @param {(why: Problem) => unknown} [way] what is offered where it cannot be made
   */
  making(way = () => null) {
    const { entry, trouble, kind } = this;
    if (!entry) return null;
    if (entry.state === "building") return this.#rowOf(entry.progress);
    const why = entry.made ? null : entry.refusal;
    return [
      trouble &&
        html`<div class="strip bad" role="alert">
          ${icon("warn")}
          <div><strong>The last ${kind} was not finished. </strong>${sentence(trouble.detail)}</div>
          ${toolButton("Dismiss", "close", () => this.dismiss())}
        </div>`,
      why &&
        html`<div class="strip warn" role="status">
          ${icon("warn")}
          <div>
            <strong>No ${kind} can be made of it. </strong>${sentence(why.detail)}
            ${way(why)}
          </div>
        </div>`,
    ];
  }

  /** @param {T["progress"]} first as it was when the document was read */
  #rowOf(first) {
    const { state, progress = first } = this.jobs.job ?? {};
    const note = progress?.note ? sentence(progress.note).slice(0, -1) : "Reading the dataset";
    const step = shareOf(progress) === null ? "" : `step ${progress?.done} of ${progress?.total}`;
    const words = [note, step, timeLeft(progress?.eta_s)].filter(Boolean).join(" · ");
    const cancel = () => this.jobs.cancel(this.commands);
    return jobRow({ state, progress }, { label: `Making the ${this.kind}`, words, cancel });
  }
}
