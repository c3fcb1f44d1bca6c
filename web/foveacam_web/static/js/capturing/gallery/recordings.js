// The recordings of the gallery: their list, or one recording. Orders: computes depth and makes films.

import { RequestError, request } from "../../transport/api.js";
import { badge } from "../../elements/parts.js";
import { h, html } from "../../elements/dom.js";
import { sentence } from "../../elements/format.js";
import { makeImporter } from "../replay/importer.js";
import { archivedBadge } from "./archive.js";
import { openEntry, openList } from "./collection.js";
import { CollectionOrders } from "./collection_orders.js";
import { EntryReader, ListReader } from "./collection_readers.js";
import { makeRecordingPage } from "./recording_page.js";
import { boundWords, clockWords, isBeingMade, recordingPath, stateWords, tallyWords } from "./recording_words.js";

/**
 * @import { RecordedDepthDocument, RecordingDocument } from "#api"
 * @import { GalleryPlace } from "#page"
 * @import { GalleryContext } from "./page.js"
 */

const NOUN = Object.freeze({ one: "recording", many: "recordings" });
const DEPTH_MS = 60_000; // the matcher takes a second, and other requests may be queued before this one

/** @param {GalleryPlace} at @param {GalleryContext} context @returns {HTMLElement} */
export function openRecordings({ id, part }, context) {
  if (id !== null) return openRecording(id, part, context);
  /** @type {ListReader<RecordingDocument>} */
  const reader = new ListReader({
    resource: "/recordings",
    onEvent: (list, { kind }) => void (kind.startsWith("recording.") && list.readAll()),
  });
  const { store, signal } = context;
  const importer = makeImporter(context);
  const list = openList(
    {
      noun: NOUN,
      hint: "Name, label, id or state",
      orders: new RecordingOrders(context, () => reader.readAll()),
      reader,
      card: cardOf,
      above: () => importer,
      intro: () =>
        "The round button in the bar at the top records what all three cameras deliver, while you go on working.",
    },
    context,
  );
  let made = false;
  store.on(
    ["recording"],
    ({ recording }) => {
      if (recording) reader.change(recording.id, () => recording);
      else if (made) void reader.readList(); // its last change may have come while the list was read
      made = recording !== null;
    },
    signal,
  );
  return list;
}

/** @param {string} id @param {string | null} part @param {GalleryContext} context */
function openRecording(id, part, context) {
  if (part !== null) return h("p", { class: "empty", text: "There is no such page." });
  const orders = new RecordingOrders(context);
  /** @type {EntryReader<RecordingDocument>} */
  const reader = new EntryReader(
    recordingPath(id),
    ({ kind, data }) => kind.startsWith("recording.") && data?.["recording_id"] === id,
  );
  const place = openEntry(
    { noun: NOUN, reader, page: makeRecordingPage(id, { noun: NOUN, orders, reader, context }) },
    context,
  );
  const { store, signal } = context;
  store.on(["recording"], ({ recording }) => recording?.id === id && reader.adopt(recording), signal);
  return place;
}

/** @param {RecordingDocument} recording */
function cardOf(recording) {
  const { state, removed, playable, why, duration_s } = recording;
  const { text, tone } = stateWords(recording);
  const made = isBeingMade(recording);
  const none = state === "damaged" ? "No picture: it cannot be read" : "No frame in it";
  return {
    state,
    removed,
    busy: made ? "Not while it is being made" : "",
    blank: made ? "Being recorded" : playable ? "" : none,
    picture: coverUrl(recording),
    facts: html`<p class="facts">
        ${badge(tone, text)}${archivedBadge(recording)}<span class="number">${clockWords(duration_s, 1)}</span>
        <span class="tally-words">${tallyWords(recording)}</span>
      </p>
      ${made && html`<p class="bound">${sentence(boundWords(recording))}</p>`}
      ${why !== "" && html`<p class="reason">${sentence(why)}</p>`}`,
  };
}

/** @param {RecordingDocument} recording */
function coverUrl({ url, streams }) {
  const shown =
    streams.find(({ role, frames }) => role === "wide" && frames > 0) ??
    streams.find(({ role, frames }) => role !== null && frames > 0);
  return `${url}/frames/${shown?.role ?? "wide"}/${Math.floor((shown?.frames ?? 0) / 2)}.jpg?scale=2`;
}

/** The recording commands of one page. @extends {CollectionOrders<RecordingDocument>} */
export class RecordingOrders extends CollectionOrders {
  /** @param {Pick<GalleryContext, "commands">} context @param {() => unknown} [changed] */
  constructor({ commands }, changed) {
    super({ commands, resource: "/recordings", changed });
  }

  /**
   * Return the depth of a moment, or the reason why there is none.
   * @param {string} id
   * @param {number} t_s
   * @param {{backend: string, research_confirmed: boolean}} by
   * @returns {Promise<RecordedDepthDocument | RequestError>}
   */
  async depth(id, t_s, { backend, research_confirmed }) {
    const query = new URLSearchParams({ t_s: t_s.toFixed(6), backend });
    if (research_confirmed) query.set("research_confirmed", "true");
    const path = this.path(id, `/depth?${query}`);
    try {
      return await request("GET", path, { patience_ms: DEPTH_MS });
    } catch (error) {
      if (error instanceof RequestError) return error;
      throw error;
    }
  }
}
