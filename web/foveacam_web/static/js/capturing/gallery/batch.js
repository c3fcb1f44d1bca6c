// Batches of datasets: ticks on the cards, a form, the progress of the job, and a link to what it made.

import { request } from "../../transport/api.js";
import { choiceField, jobRow, show, textButton } from "../../elements/parts.js";
import { h, html, update } from "../../elements/dom.js";
import { sentence } from "../../elements/format.js";
import { icon } from "../../elements/icons.js";
import { JobFollower } from "../../transport/jobs.js";
import { BATCH_KINDS, EXPORTS, placesOf, progressWords, resultWords, tickedWords } from "./batch_words.js";

/**
 * @import { BatchClusterDocument, BatchDocument, BatchRequest, CaptureDocument, EventDocument, JobDocument } from "#api"
 * @import { Job } from "#page"
 * @import { GalleryContext } from "./page.js"
 */

const KIND = "batch";

/** The ticked datasets, and the newest batch. */
class Batch {
  /** @type {Set<string>} */
  ticked = new Set();
  asked = false;
  jobs = new JobFollower({ ours: ({ kind }) => kind === KIND, news: (job) => this.#take(job) });
  /** @type {BatchDocument | null} */
  made = null;
  /** @type {string | null} the scheduler whose workers may make it */
  cluster = null;
  changed = () => {};

  /** @param {Pick<GalleryContext, "commands">} context */
  constructor({ commands }) {
    this.commands = commands;
  }

  /** @param {string} id @param {boolean} on */
  tick(id, on) {
    if (on) this.ticked.add(id);
    else this.ticked.delete(id);
    this.changed();
  }

  /** @param {boolean} open whether the form is shown */
  ask(open) {
    this.asked = open;
    this.changed();
  }

  /** @param {BatchRequest} body */
  async make(body) {
    const job = await this.commands.send("POST", "/batches", { body });
    if (job === null) return;
    [this.asked, this.made] = [false, null];
    this.jobs.follow(/** @type {JobDocument} */ (job));
  }

  cancel() {
    return this.jobs.cancel(this.commands);
  }

  /** Read the newest batch, which may run since before the page was opened. */
  async readAll() {
    const cluster = await request("GET", "/batches/cluster").catch(() => null); // then this machine makes it
    this.cluster = /** @type {BatchClusterDocument | null} */ (cluster)?.url ?? null;
    const jobs = /** @type {JobDocument[]} */ (await request("GET", "/jobs"));
    const job = jobs.find(({ kind }) => kind === KIND);
    if (job) this.jobs.follow(job);
  }

  /** @param {EventDocument} event */
  onEvent(event) {
    this.jobs.onEvent(event);
  }

  forget() {
    this.jobs.forget();
  }

  /** @param {Job} job */
  async #take({ result_url }) {
    const path = result_url?.split("/").pop();
    this.made = path ? await request("GET", `/batches/${path}`).catch(() => null) : null; // it may have been removed
    this.changed();
  }
}

/**
 * Return the tick of a dataset's card, and the element above the list.
 * @param {GalleryContext} context
 * @param {() => void} changed called when the cards have to be shown again
 */
export function makeBatch({ commands, follow }, changed) {
  const batch = new Batch({ commands });
  const place = h("div", { class: "batch" });
  /** @type {HTMLElement | null} */
  let form = null;
  batch.changed = () => {
    form = batch.asked ? (form ?? formOf(batch)) : null;
    update(place, [html`<p class="actions">${openButton(batch)}</p>`, form, statusOf(batch)]);
    changed();
  };
  batch.changed();
  follow(batch);
  return {
    above: () => place,
    tick: (/** @type {CaptureDocument} */ { id, name }) =>
      html`<label class="field tick">
        <input
          type="checkbox" aria-label="Tick ${name} for a batch" .checked=${batch.ticked.has(id)}
          @change=${(/** @type {{target: HTMLInputElement}} */ { target }) => batch.tick(id, target.checked)}
        />
      </label>`,
  };
}

/** @param {Batch} batch */
function openButton(batch) {
  const count = batch.ticked.size;
  return html`${textButton("Batch …", () => batch.ask(!batch.asked), {
    title: "Depth, mosaics, exports or figures of all ticked datasets",
    disabled: count === 0 && !batch.asked,
    expanded: batch.asked,
  })}
    <span class="why" role="status">${tickedWords(count)}</span>`;
}

/** @param {Batch} batch */
function formOf(batch) {
  const to = choiceField("Format", EXPORTS);
  const kind = choiceField("Make", BATCH_KINDS, (value) => {
    to.element.hidden = value !== "export";
  });
  to.element.hidden = true;
  const by = choiceField("By", placesOf(batch.cluster));
  by.element.hidden = batch.cluster === null;
  const start = () =>
    void batch.make({
      kind: /** @type {BatchRequest["kind"]} */ (kind.value()),
      to: /** @type {NonNullable<BatchRequest["to"]>} */ (to.value()),
      capture_ids: [...batch.ticked],
      cluster: by.value() === "cluster",
    });
  const button = textButton("Start", start);
  const place = h("div", { class: "batch-form" });
  show(place, [kind.element, to.element, by.element, button]);
  return place;
}

/** @param {Batch} batch */
function statusOf(batch) {
  const { job, running } = batch.jobs;
  const { made } = batch;
  if (job === null) return null;
  if (running)
    return jobRow(job, {
      label: "Progress of the batch",
      words: progressWords(job.progress),
      cancel: () => batch.cancel(),
    });
  if (made?.download_url)
    return html`<p class="actions" role="status">
      <span>${resultWords(made)}</span>
      <a class="plain" href=${made.download_url} download="">${icon("down")}Products (ZIP)</a>
      ${made.picture_url && html`<a class="plain" href=${made.picture_url} target="_blank" rel="noopener">Overview</a>`}
    </p>`;
  return job.problem && html`<p class="reason" role="alert">${sentence(job.problem.detail)}</p>`;
}
