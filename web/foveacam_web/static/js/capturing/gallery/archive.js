// Shows whether a dataset, recording or still is in the archive; sends it there and fetches it, with progress.

import { outcome, request } from "../../transport/api.js";
import { html } from "../../elements/dom.js";
import { sentence } from "../../elements/format.js";
import { badge, jobRow, panel, textButton } from "../../elements/parts.js";
import { hasEnded, JobFollower } from "../../transport/jobs.js";
import { archivedWords, sizeWords } from "./dataset_words.js";

/**
 * @import { ArchiveDocument, ArchivedDocument } from "#api"
 * @import { Commands } from "#console"
 * @import { CollectionOrders } from "./collection_orders.js"
 * @import { EntryReader } from "./collection_readers.js"
 * @typedef {{id: string, name: string, archived: ArchivedDocument | null}} Archivable
 */

/** @param {Archivable} entry */
export function archivedBadge({ archived }) {
  return archived && badge("plain", "archived", archived.local ? "Here and in the archive" : "In the archive alone");
}

/**
 * Return a function that shows the archive's panel; it shows nothing where the server has no archive.
 * @template {Archivable & {id: string, name: string}} T
 * @param {{orders: CollectionOrders<T>, reader: EntryReader<T>, signal: AbortSignal}} context
 */
export function makeArchive({ orders, reader, signal }) {
  let url = /** @type {string | null} */ (null);
  const changed = () => reader.entry && reader.changed();
  const jobs = new JobFollower({
    news: async (job) => {
      changed();
      if (!hasEnded(job.state)) return;
      await orders.notifyEnd(job);
      await reader.readAll();
      changed();
    },
  });
  signal.addEventListener("abort", () => jobs.forget());
  let sending = false;
  const start = async (/** @type {string} */ path, /** @type {object | undefined} */ body = undefined) => {
    if (sending) return;
    sending = true;
    await orders.start(path, body, jobs);
    sending = false;
  };
  const ask = async () => {
    const found = await outcome(/** @type {Promise<ArchiveDocument>} */ (request("GET", "/archive")));
    url = found.answer?.url ?? null; // null: it is shown without the panel
    if (!signal.aborted && url !== null) changed();
  };
  void ask();
  return (/** @type {T} */ entry) => {
    const { id, archived } = entry;
    if (url === null && archived === null) return null;
    const send = (/** @type {boolean} */ remove_local) => () =>
      void start(orders.path(id, "/archive"), { remove_local });
    const fetch = () => void start(orders.path(id, "/fetch"));
    return panel(
      "Archive",
      html`<div class="stack">
        <p class="lead">${archived ? sentence(archivedWords(archived)) : `It is not in the archive ${url} yet.`}</p>
        ${archived && html`<p class="note archive-url">${archived.url}</p>`}
        ${jobs.running ? progressOf(jobs, orders.commands) : html`<p class="actions">${buttons(archived, { url, send, fetch })}</p>`}
      </div>`,
    );
  };
}

/** @param {JobFollower} jobs @param {Commands} commands */
function progressOf(jobs, commands) {
  const { done = 0, total = 0 } = jobs.job?.progress ?? {};
  const text = total > 0 ? `${sizeWords(1000 * done)} of ${sizeWords(1000 * total)}` : "Preparing …";
  return jobRow(jobs.job, { label: "Progress of the archive", words: text, cancel: () => jobs.cancel(commands) });
}

/**
 * @param {ArchivedDocument | null} archived
 * @param {{url: string | null, send: (remove_local: boolean) => () => void, fetch: () => void}} acts
 */
function buttons(archived, { url, send, fetch }) {
  if (archived && !archived.local) return textButton("Fetch", fetch, { kind: "plain primary", picture: "down" });
  if (url === null) return null;
  const smaller = "Keep only its description and thumbnail here; the rest is read from the archive";
  return [
    textButton(archived ? "Archive again" : "Archive", send(false), { picture: "file" }),
    archived && textButton("Keep the small ones here", send(true), { title: smaller }),
  ];
}
