// The datasets of the gallery: their list, one dataset, or a further page about one.

import { badge, bar } from "../../elements/parts.js";
import { fresh } from "../../calibrating/calibration/pictures.js";
import { shareOf } from "../capture/state.js";
import { html } from "../../elements/dom.js";
import { sentence } from "../../elements/format.js";
import { request } from "../../transport/api.js";
import { archivedBadge } from "./archive.js";
import { makeBatch } from "./batch.js";
import { openEntry, openList } from "./collection.js";
import { CollectionOrders } from "./collection_orders.js";
import { EntryReader, ListReader } from "./collection_readers.js";
import { DATASET_PARTS, makeDatasetPage } from "./dataset_page.js";
import { capturePath, isLive, pointsWords, progressWords, sizeWords, stateWords } from "./dataset_words.js";

/**
 * @import { CaptureDocument, EventDocument, PointsDocument } from "#api"
 * @import { GalleryPlace } from "#page"
 * @import { GalleryContext } from "./page.js"
 * @typedef {CaptureDocument["progress"] & {capture_id: string, state: CaptureDocument["state"], wish: string}} ProgressNews
 */

const NOUN = Object.freeze({ one: "dataset", many: "datasets" });
const GROWING_MS = 10_000; // interval of redrawing the pictures of a running capture: drawing costs the server time

/** @param {GalleryPlace} at @param {GalleryContext} context @returns {HTMLElement} */
export function openDatasets(at, context) {
  const part = DATASET_PARTS.find(({ name }) => name === at.part);
  if (at.id !== null) return part ? part.open(at, context) : openDataset(at.id, context);
  /** @type {ListReader<CaptureDocument>} */
  const reader = new ListReader({ resource: "/captures", onEvent });
  const batch = makeBatch(context, () => reader.changed());
  return openList(
    {
      noun: NOUN,
      hint: "Name, label, id or state",
      orders: new DatasetOrders(context, () => reader.readAll()),
      reader,
      card: (dataset) => ({ ...cardOf(dataset), tick: batch.tick(dataset) }),
      above: batch.above,
      key: ({ id, folder }) => `${id} ${folder}`,
      intro: () =>
        html`A raster that is captured shows up here from its first point on. <a href="#/capture">Plan a capture</a>.`,
    },
    context,
  );
}

/** @param {string} id @param {GalleryContext} context */
function openDataset(id, context) {
  const reader = new DatasetReader(id);
  const orders = new DatasetOrders(context);
  return openEntry({ noun: NOUN, reader, page: makeDatasetPage(id, { noun: NOUN, orders, reader, context }) }, context);
}

/** @param {CaptureDocument} dataset */
function cardOf(dataset) {
  const { state, removed, points, url, size_bytes, why } = dataset;
  const { text, tone } = stateWords(dataset);
  const live = isLive(dataset);
  const numbers = [pointsWords(dataset), size_bytes > 0 ? sizeWords(size_bytes) : ""].filter(Boolean);
  return {
    state,
    removed,
    busy: live ? "Not while it runs" : "",
    blank: state === "damaged" ? "No picture: it cannot be read" : points.taken === 0 ? "Nothing taken yet" : "",
    picture: fresh(`${url}/thumbnail.jpg`, String(points.taken)),
    facts: html`<p class="facts">
        ${badge(tone, text)}${archivedBadge(dataset)}${numbers.map((words) => html`<span class="number">${words}</span>`)}
      </p>
      ${!live && why !== "" && html`<p class="reason">${sentence(why)}</p>`}`,
    progress: live && progressOf(dataset, `Progress of ${dataset.name}`),
  };
}

/** @param {CaptureDocument} dataset @param {string} label */
export function progressOf(dataset, label) {
  const text = progressWords(dataset);
  return [bar(label, { share: shareOf(dataset), text }), html`<p class="note">${text}</p>`];
}

/** Apply an event to the list. @param {ListReader<CaptureDocument>} reader @param {EventDocument} event */
function onEvent(reader, { kind, data }) {
  if (kind !== "capture.progress") return void (kind.startsWith("capture.") && reader.readAll());
  const news = /** @type {any} */ (data); // any: the data of this event kind, which OpenAPI leaves open
  const known = reader.list?.find(({ id }) => id === news.capture_id);
  if (!known || known.state !== news.state || known.progress?.phase !== news.phase) void reader.readList();
  reader.change(news.capture_id, (each) => withProgress(each, news));
}

/** @param {CaptureDocument} dataset @param {ProgressNews} news @returns {CaptureDocument} */
function withProgress(dataset, { capture_id: _, state, wish, ...progress }) {
  return { ...dataset, state, why: wish, progress };
}

/** The dataset commands of one page. @extends {CollectionOrders<CaptureDocument>} */
export class DatasetOrders extends CollectionOrders {
  /** @param {Pick<GalleryContext, "commands">} context @param {() => unknown} [changed] */
  constructor({ commands }, changed) {
    super({ commands, resource: "/captures", changed });
  }

  /** Resume a partial dataset; return whether the server accepted it. @param {string} id */
  async resume(id) {
    return (await this.commands.send("POST", this.path(id, "/resume"))) !== null;
  }
}

/** The reads of one dataset and its points. @extends {EntryReader<CaptureDocument>} */
export class DatasetReader extends EntryReader {
  #id;
  #due_ms = 0;
  /** @type {PointsDocument | null} */
  points = null;

  /** @param {string} id */
  constructor(id) {
    super(capturePath(id), ({ kind, data }) => data?.["capture_id"] === id && kind.startsWith("capture."));
    this.#id = id;
  }

  /** @override @param {CaptureDocument} dataset */
  async readMore({ state, points }) {
    this.#due_ms = performance.now() + GROWING_MS;
    const readable = state !== "damaged" && points.planned > 0;
    this.points = readable ? await request("GET", capturePath(this.#id, "/points")) : null;
  }

  /** @override @param {EventDocument} event */
  onEvent(event) {
    if (event.kind !== "capture.progress") return super.onEvent(event);
    const news = /** @type {any} */ (event.data); // any: the data of this event kind, which OpenAPI leaves open
    const { entry } = this;
    if (news.capture_id !== this.#id) return;
    const known = entry?.state === news.state && entry?.progress?.phase === news.phase;
    if (!known || performance.now() > this.#due_ms) void this.readAll();
    if (entry) this.adopt(withProgress(entry, news));
  }
}
