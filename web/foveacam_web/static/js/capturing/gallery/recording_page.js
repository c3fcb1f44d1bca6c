// The page of one recording: state, player, depth, film, contents, and buttons.

import { RequestError, request } from "../../transport/api.js";
import { badge, figures, nothing, panel } from "../../elements/parts.js";
import { h, html, update } from "../../elements/dom.js";
import { count, dayTime, sentence } from "../../elements/format.js";
import { icon } from "../../elements/icons.js";
import { archivedBadge, makeArchive } from "./archive.js";
import { headOf } from "./collection.js";
import { sizeWords } from "./dataset_words.js";
import { makeEditable, saveOf } from "./editable.js";
import { makeDepth } from "../replay/depth.js";
import { makeExports } from "../replay/exports.js";
import { Player } from "../replay/player.js";
import {
  CAMERAS,
  clockWords,
  isBeingMade,
  lossWords,
  rateWords,
  recordingPath,
  sizeOf,
  stateWords,
} from "./recording_words.js";

/**
 * @import { RecordedStreamDocument, RecordingDocument, TimelineDocument, TracksDocument } from "#api"
 * @import { Noun } from "./collection.js"
 * @import { EntryReader } from "./collection_readers.js"
 * @import { GalleryContext } from "./page.js"
 * @import { RecordingOrders } from "./recordings.js"
 */

const COLUMNS = [
  ["Camera", ""],
  ["Frames", ""],
  ["Dropped", "Received, but not written to the file"],
  ["Missing", "Gaps in the numbers of the received frames: not read in time, or never received"],
  ["Rate", ""],
];

/**
 * Return a function that shows a recording.
 * @param {string} id
 * @param {{noun: Noun, orders: RecordingOrders, reader: EntryReader<RecordingDocument>, context: GalleryContext}} tools
 */
export function makeRecordingPage(id, { noun, orders, reader, context }) {
  const label = makeEditable("Label", { save: saveOf("label", id, { orders, reader }), hint: "What is to be seen" });
  const stage = makeStage(id, orders, context);
  const archive = makeArchive({ orders, reader, signal: context.signal });
  return (/** @type {RecordingDocument} */ recording) => {
    const { state, why, truncated, file, url, archived } = recording;
    const { tone, text } = stateWords(recording);
    const made = isBeingMade(recording);
    const rest = truncated ? " What comes before was found by reading the file through, and is whole." : "";
    stage.show(recording);
    return html`<article class="dataset-page recording-page">
      ${headOf(recording, {
        noun,
        orders,
        word: [badge(tone, text), archivedBadge(recording)],
        busy: made ? "Not while it is being made" : "",
        actions:
          !made &&
          state !== "damaged" &&
          archived?.local !== false &&
          html`<a class="plain" href="${url}/download.fcap" download=${file}>${icon("down")}Download the file</a>`,
        far:
          why !== "" &&
          html`<p class=${state === "damaged" ? "strip bad" : "strip warn"}>${icon("warn")}${sentence(why)}${rest}</p>`,
      })}
      <div class="dataset-body">
        ${stage.element}
        <div class="column">
          ${stage.beside}
          ${panel("Cameras", html`<div class="stack">${camerasOf(recording.streams)}</div>`)}
          ${panel("About", label(recording.label), html`<div class="stack">${figures(factRows(recording))}</div>`)}
          ${!made && state !== "damaged" && archive(recording)}
        </div>
      </div>
    </article>`;
  };
}

/**
 * Show the player as soon as the recording can be played, with depth and film beside it.
 * @param {string} id
 * @param {RecordingOrders} orders
 * @param {GalleryContext} context
 */
function makeStage(id, orders, { store, signal }) {
  const [element, beside] = [h("div", { class: "column" }), h("div", { class: "column" })];
  let shown = "";
  const begin = async (/** @type {RecordingDocument} */ recording) => {
    try {
      const read = (/** @type {string} */ part) => request("GET", recordingPath(id, part), { patience_ms: 60_000 });
      const [timeline, tracks] = await Promise.all([read("/timeline"), read("/tracks")]);
      if (signal.aborted) return;
      const depth = makeDepth(id, { orders, at: () => player.at_s });
      const player = new Player(
        { id, timeline: /** @type {TimelineDocument} */ (timeline), tracks: /** @type {TracksDocument} */ (tracks) },
        { store, signal, moved: (at_s) => depth.move(at_s), depth: () => void depth.compute() },
      );
      update(element, player.element);
      update(beside, [
        panel("Depth", depth.element),
        panel("Export", makeExports(recording, { orders, signal, span: () => player.span })),
      ]);
      await player.restore();
    } catch (error) {
      if (!(error instanceof RequestError)) throw error;
      update(element, nothing(sentence(error.message)));
    }
  };
  const emptyWords = (/** @type {RecordingDocument} */ { state }) =>
    state === "damaged"
      ? "It cannot be played, as it cannot be read. Its file was left alone."
      : "There is no frame in it.";
  return {
    element,
    beside,
    show: (/** @type {RecordingDocument} */ recording) => {
      const made = isBeingMade(recording);
      const now = made ? "made" : recording.playable ? "play" : "empty";
      if (now === shown) return;
      shown = now;
      if (now === "play") return void begin(recording);
      update(element, nothing(made ? "It is being made. It can be played once it has ended." : emptyWords(recording)));
    },
  };
}

/** @param {number | null} counted */
function countedWords(counted) {
  return counted === null ? "not counted" : count(counted);
}

/** @param {RecordedStreamDocument[]} streams */
function camerasOf(streams) {
  if (streams.length === 0) return nothing("No camera in it.");
  const lossy = streams.filter((stream) => lossWords(stream) !== "");
  return html`<table class="tally">
      <thead><tr>${COLUMNS.map(([text, title]) => html`<th scope="col" title=${title}>${text}</th>`)}</tr></thead>
      <tbody>${streams.map(rowOf)}</tbody>
    </table>
    ${lossy.map((stream) => html`<p class="why">${stream.name}: dropped ${lossWords(stream)}</p>`)}`;
}

/** @param {RecordedStreamDocument} stream */
function rowOf(stream) {
  const { role, name, frames, dropped, missing, fps } = stream;
  return html`<tr>
    <th scope="row" class="role-${role}" title=${sizeOf(stream)}>${role === null ? name : CAMERAS[role]}</th>
    <td>${count(frames)}</td>
    <td class=${(dropped ?? 0) > 0 ? "warn-text" : ""}>${countedWords(dropped)}</td>
    <td>${countedWords(missing)}</td>
    <td>${rateWords(fps)}</td>
  </tr>`;
}

/** @param {RecordingDocument} recording @returns {[string, string | null][]} */
function factRows(recording) {
  return [
    ["Length", clockWords(recording.duration_s, 1)],
    ["Size", sizeWords(recording.size_bytes)],
    ["Recorded", dayTime(recording.created_utc)],
    ["Rig", recording.rig_id],
    ["Calibration", recording.calibration_id ?? recording.calibration_problem ?? "none in it"],
    ["File", recording.file],
  ];
}
