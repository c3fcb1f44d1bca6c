// The exports of a dataset: the button beside the download, and the panel with a format each, its job and its file.

import { hasEnded, JobFollower } from "../../transport/jobs.js";
import { copiedCode } from "../../elements/copy.js";
import { html } from "../../elements/dom.js";
import { sentence } from "../../elements/format.js";
import { icon } from "../../elements/icons.js";
import { jobRow, panel, textButton, toolButton } from "../../elements/parts.js";
import { waiting } from "../../elements/waiting.js";
import { offers } from "../../operating/session/words.js";
import { EntryReader } from "./collection_readers.js";
import { capturePath, sizeWords } from "./dataset_words.js";
import { EXPORT_KINDS, exportProgress, largestWords, madeWords } from "./export_words.js";

/**
 * @import { DatasetExport, DatasetExports, EventDocument, JobDocument, MadeExport } from "#api"
 * @import { Commands, Job } from "#console"
 * @import { ExportWords } from "./export_words.js"
 * @import { GalleryContext } from "./page.js"
 * @typedef {DatasetExport["kind"]} Kind
 */

/** The exports of one dataset: follows the job that makes one, starts, cancels and removes. @extends {EntryReader<DatasetExports>} */
class Exports extends EntryReader {
  /** The formats whose last attempt failed or was refused, with the server's sentence. @type {Map<Kind, string>} */
  troubles = new Map();
  /** Whether the panel is shown; it opens by itself where a job runs. */
  open = false;
  /** The format that the followed job makes. @type {Kind | null} */
  making = null;
  jobs = new JobFollower({ news: (job) => this.#take(job) });

  /** @param {string} id of the dataset @param {Commands} commands */
  constructor(id, commands) {
    const path = capturePath(id, "/exports");
    super(path, ({ kind, data }) => data?.["capture_id"] === id && /^(export\.|capture\.(updated|ended))/.test(kind));
    this.path = path;
    this.commands = commands;
  }

  /** @override @param {DatasetExports} found */
  async readMore({ exports }) {
    const running = exports.find(({ job_id }) => job_id !== null);
    if (running?.job_id) {
      if (this.jobs.id !== running.job_id) this.open = true;
      this.making = running.kind;
      this.jobs.expect(running.job_id);
    } else if (this.jobs.running) await this.jobs.readAll(); // its end was not heard of
  }

  /** @param {Job} job */
  #take({ state, problem }) {
    if (hasEnded(state)) {
      if (state === "failed" && problem && this.making) this.troubles.set(this.making, problem.detail);
      void this.readAll();
    }
    this.changed();
  }

  /** @override @param {EventDocument} event */
  onEvent(event) {
    this.jobs.onEvent(event);
    super.onEvent(event);
  }

  /** Leave it: the page is closed. */
  forget() {
    this.jobs.forget();
  }

  turn() {
    this.open = !this.open;
    this.changed();
  }

  /** @param {Kind} kind */
  dismiss(kind) {
    this.troubles.delete(kind);
    this.changed();
  }

  /** @param {Kind} kind */
  async make(kind) {
    this.dismiss(kind);
    const { answer, error } = await this.commands.tried("POST", this.path, { body: { kind }, shows: () => false });
    if (error) this.troubles.set(kind, error.document.detail);
    else {
      this.making = kind;
      this.jobs.follow(/** @type {JobDocument} */ (answer));
    }
    await this.readAll();
  }

  cancel() {
    return this.jobs.cancel(this.commands);
  }

  /** @param {Kind} kind */
  async remove(kind) {
    await this.commands.send("DELETE", `${this.path}/${kind}`);
    await this.readAll();
  }
}

/**
 * Return functions that show the button and the panel of a dataset's exports.
 * @param {string} id
 * @param {GalleryContext} context
 * @param {() => void} changed called when they have to be shown again
 */
export function makeExports(id, { store, commands, follow }, changed) {
  const exports = new Exports(id, commands);
  exports.changed = changed;
  follow(exports);
  const button = () =>
    textButton("Export", () => exports.turn(), {
      picture: "file",
      expanded: exports.open,
      title: "As files for Hugging Face, COLMAP, nerfstudio or OME-Zarr",
    });
  const shown = () => {
    if (!exports.open) return null;
    const { entry } = exports;
    if (!entry) return panel("Export", waiting("Reading the exports"));
    const may_make = offers(store.state.sign_in, "operate");
    const items = entry.exports.map((one) => itemOf(one, entry.name, { exports, may_make }));
    return panel("Export", html`<ul class="dataset-exports">${items}</ul>`);
  };
  return { button, shown };
}

/** @param {DatasetExport} one @param {string} name of the dataset @param {{exports: Exports, may_make: boolean}} context */
function itemOf(one, name, { exports, may_make }) {
  const words = EXPORT_KINDS[one.kind];
  if (!words) return null; // a format of the command line alone
  const trouble = exports.troubles.get(one.kind);
  const busy = exports.jobs.running || one.job_id !== null;
  const remove =
    may_make &&
    toolButton(`Remove the export for ${words.title}`, "trash", () => exports.remove(one.kind), {
      title: "Remove it: the dataset stays, and can be exported again",
      disabled: busy,
    });
  return html`<li class="dataset-export" data-kind=${one.kind}>
    <h4>${words.title}</h4>
    <p class="note">${words.purpose}</p>
    ${
      trouble &&
      html`<div class="strip bad" role="alert">
        ${icon("warn")}
        <div>${sentence(trouble)}</div>
        ${toolButton("Dismiss", "close", () => exports.dismiss(one.kind))}
      </div>`
    }
    ${one.made && fileOf(one.made, { words, folder: `${name}-${one.kind}`, remove })}
    ${one.state === "building" ? rowOf(one, words, exports) : offerOf(one, words, { exports, may_make, busy })}
  </li>`;
}

/** @param {MadeExport} made @param {{words: ExportWords, folder: string, remove: unknown}} context `folder`: in the ZIP file */
function fileOf(made, { words: { title, load }, folder, remove }) {
  return html`<p class="actions">
      <a class="plain primary" href=${made.download_url} download="${folder}.zip">
        ${icon("down")}Download ${title}, ${sizeWords(made.size_bytes)}
      </a>
      ${remove}
    </p>
    <p class=${made.outdated ? "warn-text" : "note"}>${madeWords(made)} Unpack it, then:</p>
    ${copiedCode(load(folder), `Loads the export for ${title}`)}`;
}

/** @param {DatasetExport} one @param {ExportWords} words @param {Exports} exports */
function rowOf(one, { title }, exports) {
  const { state, progress = one.progress } = exports.jobs.job ?? {};
  return jobRow(
    { state, progress },
    { label: `Export for ${title}`, words: exportProgress(progress), cancel: () => exports.cancel() },
  );
}

/** @param {DatasetExport} one @param {ExportWords} words @param {{exports: Exports, may_make: boolean, busy: boolean}} context */
function offerOf({ kind, made, refusal, largest_bytes }, { title }, { exports, may_make, busy }) {
  if (made && !made.outdated) return null;
  if (refusal) return html`<p class="reason">${sentence(refusal.detail)}</p>`;
  if (!may_make) return made === null && html`<p class="note">Not made yet; an operator can make it.</p>`;
  return html`<p class="actions">
    ${textButton(made ? "Make it again" : `Export for ${title}`, () => exports.make(kind), { disabled: busy })}
    <span class="why">${busy ? "Another export is being made." : largestWords(largest_bytes)}</span>
  </p>`;
}
