// Shows whether a dataset, recording or still is in the archive; sends it there and fetches it, with progress.

import { RequestError, request } from "../../transport/api.js";
import { html } from "../../elements/dom.js";
import { sentence } from "../../elements/format.js";
import { icon } from "../../elements/icons.js";
import { badge, bar, panel } from "../../elements/parts.js";
import { archivedWords, sizeWords } from "./dataset_words.js";

/**
 * @import { ArchiveDocument, ArchivedDocument } from "#api"
 * @import { CollectionOrders } from "./collection_orders.js"
 * @typedef {{id: string, name: string, archived: ArchivedDocument | null}} Archivable
 */

/** @param {Archivable} entry */
export function archivedBadge({ archived }) {
  return archived && badge("plain", "archived", archived.local ? "Here and in the archive" : "In the archive alone");
}

/**
 * Return a function that shows the archive's panel; it shows nothing where the server has no archive.
 * @template {Archivable & {id: string, name: string}} T
 * @param {{orders: CollectionOrders<T>, signal: AbortSignal, changed: () => unknown, read: () => unknown}} context
 *   `changed`: called when it has to be shown again; `read`: reads the entry again
 */
export function makeArchive({ orders, signal, changed, read }) {
  let url = /** @type {string | null} */ (null);
  /** @type {{done: number, total: number, cancelled: AbortController} | null} */
  let running = null;
  const ask = async () => {
    try {
      ({ url } = /** @type {ArchiveDocument} */ (await request("GET", "/archive")));
    } catch (error) {
      if (!(error instanceof RequestError)) throw error; // it is shown without the panel
    }
    if (!signal.aborted && url !== null) changed();
  };
  void ask();
  const run = async (/** @type {string} */ path, /** @type {object | undefined} */ body) => {
    const cancelled = new AbortController();
    running = { done: 0, total: 0, cancelled };
    changed();
    const told = (/** @type {number} */ done, /** @type {number} */ total) => {
      running = { done, total, cancelled };
      changed();
    };
    await orders.runJob(path, body, { told, signal, cancelled: cancelled.signal });
    running = null;
    if (!signal.aborted) await read();
    changed();
  };
  return (/** @type {T} */ entry) => {
    const { id, archived } = entry;
    if (url === null && archived === null) return null;
    const send = (/** @type {boolean} */ remove_local) => () => void run(orders.path(id, "/archive"), { remove_local });
    const fetch = () => void run(orders.path(id, "/fetch"), undefined);
    return panel(
      "Archive",
      html`<div class="stack">
        <p class="lead">${archived ? sentence(archivedWords(archived)) : `It is not in the archive ${url} yet.`}</p>
        ${archived && html`<p class="note archive-url">${archived.url}</p>`}
        ${running ? progress(running) : html`<p class="actions">${buttons(archived, { url, send, fetch })}</p>`}
      </div>`,
    );
  };
}

/** @param {{done: number, total: number, cancelled: AbortController}} running */
function progress({ done, total, cancelled }) {
  const share = total > 0 ? done / total : 0;
  const text = total > 0 ? `${sizeWords(1000 * done)} of ${sizeWords(1000 * total)}` : "Preparing …";
  return [
    bar("Progress of the archive", { share, text }),
    html`<p class="actions">
      <span class="note">${text}</span>
      <button type="button" class="plain" @click=${() => cancelled.abort()}>Cancel</button>
    </p>`,
  ];
}

/**
 * @param {ArchivedDocument | null} archived
 * @param {{url: string | null, send: (remove_local: boolean) => () => void, fetch: () => void}} acts
 */
function buttons(archived, { url, send, fetch }) {
  if (archived && !archived.local)
    return html`<button type="button" class="plain primary" @click=${fetch}>${icon("down")}Fetch</button>`;
  if (url === null) return null;
  const smaller = "Keep only its description and thumbnail here; the rest is read from the archive";
  return [
    html`<button type="button" class="plain" @click=${send(false)}>${icon("file")}${archived ? "Archive again" : "Archive"}</button>`,
    archived &&
      html`<button type="button" class="plain" title=${smaller} @click=${send(true)}>Keep the small ones here</button>`,
  ];
}
