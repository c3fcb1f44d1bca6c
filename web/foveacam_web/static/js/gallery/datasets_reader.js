// Applies the server's events to the list of datasets.

import { KeptReader } from "./kept_reader.js";

/**
 * @import { CaptureDocument, EventDocument } from "#api"
 * @typedef {CaptureDocument["progress"] & {capture_id: string, state: CaptureDocument["state"], wish: string}} ProgressNews
 */

/**
 * @param {() => void} changed
 * @returns {KeptReader<CaptureDocument>}
 */
export function readDatasets(changed) {
  return new KeptReader({ resource: "/captures", changed, hear });
}

/**
 * @param {KeptReader<CaptureDocument>} reader
 * @param {EventDocument} event
 */
function hear(reader, { kind, data }) {
  if (kind === "capture.progress")
    progressed(reader, /** @type {any} */ (data)); // any: the data of this event kind, which OpenAPI leaves open
  else if (kind.startsWith("capture.")) void reader.readAll();
}

/**
 * @param {KeptReader<CaptureDocument>} reader
 * @param {ProgressNews} news
 */
function progressed(reader, news) {
  const known = reader.list?.find(({ id }) => id === news.capture_id);
  if (!known || known.state !== news.state || known.progress?.phase !== news.phase) void reader.readList();
  reader.change(news.capture_id, (each) => withProgress(each, news));
}

/**
 * @param {CaptureDocument} dataset
 * @param {ProgressNews} news
 * @returns {CaptureDocument}
 */
export function withProgress(dataset, { capture_id: _, state, wish, ...progress }) {
  return { ...dataset, state, why: wish, progress };
}
