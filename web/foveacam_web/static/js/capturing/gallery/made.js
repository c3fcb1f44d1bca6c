// What the server makes of a dataset, a mosaic or a reference: its reads, its commands, and the making as it is shown.

import { request } from "../../transport/api.js";
import { bar } from "../../elements/parts.js";
import { html } from "../../elements/dom.js";
import { sentence } from "../../elements/format.js";
import { icon } from "../../elements/icons.js";
import { EntryReader } from "./collection_readers.js";
import { capturePath } from "./dataset_words.js";
import { leftOf } from "./mosaic/words.js";

/**
 * @import { EventDocument, JobDocument, JobProgress, Problem } from "#api"
 * @import { MakingDocument } from "#page"
 * @import { Commands } from "../../commands.js"
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
    const ended = job_id === null ? this.entry?.job_id : null;
    if (!ended) return;
    const job = /** @type {JobDocument} */ (await request("GET", `/jobs/${ended}`));
    this.trouble = job.state === "failed" ? job.problem : null;
  }

  /** Clear the problem of the last attempt. */
  forget() {
    this.trouble = null;
    this.changed();
  }

  /** @override @param {EventDocument} event */
  hear(event) {
    const { entry } = this;
    if (event.kind !== "job.updated" || !entry?.job_id || event.data?.["id"] !== entry.job_id) return super.hear(event);
    const job = /** @type {JobDocument} */ (/** @type {unknown} */ (event.data));
    if (job.ended_utc !== null || job.progress === null) return void this.readAll();
    const { done, total, eta_s, note } = job.progress;
    this.adopt({ ...entry, progress: { done, total: total ?? 0, eta_s, note: note ?? "" } });
  }

  /** @param {W} wish */
  make(wish) {
    this.forget();
    return this.#send("POST", this.path, wish);
  }

  cancel() {
    const job = this.entry?.job_id;
    return job ? this.#send("POST", `/jobs/${job}/cancel`) : this.readAll();
  }

  remove() {
    return this.#send("DELETE", this.path);
  }

  /** @param {"POST" | "DELETE"} method @param {string} path @param {W} [body] */
  async #send(method, path, body) {
    await this.commands.send(method, path, { body });
    await this.readAll();
  }

  /** Show the making: why the last attempt failed, why it cannot be made, its progress. */
  making() {
    const { entry, trouble, kind } = this;
    if (!entry) return null;
    if (entry.state === "building") return this.#progressOf(entry.progress);
    const why = entry.made ? null : entry.refusal;
    return [
      trouble &&
        html`<div class="strip bad" role="alert">
          ${icon("warn")}
          <div><strong>The last ${kind} was not finished. </strong>${sentence(trouble.detail)}</div>
          <button type="button" class="tool" aria-label="Dismiss" @click=${() => this.forget()}>${icon("close")}</button>
        </div>`,
      why &&
        html`<div class="strip warn" role="status">
          ${icon("warn")}
          <div><strong>No ${kind} can be made of it. </strong>${sentence(why.detail)}</div>
        </div>`,
    ];
  }

  /** @param {JobProgress | null} progress */
  #progressOf(progress) {
    const share = progress?.total && progress.done > 0 ? progress.done / progress.total : null;
    const note = progress?.note ? sentence(progress.note).slice(0, -1) : "Reading the dataset";
    const step = share === null ? "" : `step ${progress?.done} of ${progress?.total}`;
    const words = [note, step, leftOf(progress?.eta_s ?? null)].filter(Boolean).join(" · ");
    return html`<div class="job running">
      <div class="words">${words}</div>
      <div class="progress">${bar(`Making the ${this.kind}`, { share, text: words })}</div>
      <button type="button" class="plain" @click=${() => void this.cancel()}>Cancel</button>
    </div>`;
  }
}
