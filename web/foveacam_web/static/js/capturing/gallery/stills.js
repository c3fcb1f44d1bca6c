// The stills of the gallery: their list, or one still with the pictures of all cameras.

import { figures, panel, textButton } from "../../elements/parts.js";
import { StillOrders } from "../capture/still_orders.js";
import { picturesOf } from "../capture/still_shown.js";
import { CAMERAS, crossingWords, missingWords, stillWords } from "../capture/still_words.js";
import { html } from "../../elements/dom.js";
import { angle, count, dayTime, millis, number, sentence } from "../../elements/format.js";
import { icon } from "../../elements/icons.js";
import { archivedBadge, makeArchive } from "./archive.js";
import { headOf, makeCheck, openEntry, openList } from "./collection.js";
import { EntryReader, ListReader } from "./collection_readers.js";
import { filled, sizeWords } from "./dataset_words.js";
import { makeEditable, saveOf } from "./editable.js";

/**
 * @import { StillCamera, StillDocument } from "#api"
 * @import { GalleryPlace } from "#page"
 * @import { GalleryContext } from "./page.js"
 */

const NOUN = Object.freeze({ one: "still", many: "stills" });

/** @param {GalleryPlace} at @param {GalleryContext} context @returns {HTMLElement} */
export function openStills({ id }, context) {
  if (id !== null) return openStill(id, context);
  /** @type {ListReader<StillDocument>} */
  const reader = new ListReader({
    resource: "/stills",
    trash_query: "state=removed",
    waiting_query: "state=held",
    onEvent: (list, { kind }) => void (kind.startsWith("still.") && list.readAll()),
  });
  return openList(
    {
      noun: NOUN,
      hint: "Name, label or id",
      orders: new StillOrders({ ...context, changed: () => reader.readAll() }),
      reader,
      card: cardOf,
      intro: () =>
        html`A still is a stack of pictures of every camera, taken where the mirrors stand. <a href="#/capture">Take one</a>.`,
      above: () => reader.waiting > 0 && waitingOf(reader.waiting),
    },
    context,
  );
}

/** @param {number} waiting */
function waitingOf(waiting) {
  const words = `${count(waiting)} ${waiting === 1 ? "still was" : "stills were"} taken and neither kept nor discarded.`;
  return html`<p class="strip warn">${icon("info")}<span>${words} <a href="#/capture">Look at them</a>.</span></p>`;
}

/** @param {StillDocument} still */
function cardOf(still) {
  const { state, trouble, size_bytes, url } = still;
  const reasons = [trouble, ...missingWords(still)].filter((text) => text !== "");
  return {
    state: trouble === "" ? state : "damaged",
    removed: state === "removed",
    blank: trouble === "" ? "" : "No picture: it cannot be read",
    picture: `${url}/thumbnail.jpg`,
    facts: [
      trouble === "" &&
        html`<p class="still-facts">
          ${archivedBadge(still)}${" "}<span>${stillWords(still)} · </span><span class="number">${sizeWords(size_bytes)}</span>
        </p>`,
      reasons.map((text) => html`<p class="reason">${sentence(text)}</p>`),
    ],
  };
}

/** @param {string} id @param {GalleryContext} context */
function openStill(id, context) {
  const orders = new StillOrders(context);
  /** @type {EntryReader<StillDocument>} */
  const reader = new EntryReader(
    orders.path(id),
    ({ kind, data }) => kind.startsWith("still.") && data?.["still_id"] === id,
  );
  const label = makeEditable("Label", { save: saveOf("label", id, { orders, reader }), hint: "a line for people" });
  const check = makeCheck(orders, () => reader.changed());
  const archive = makeArchive({ orders, reader, signal: context.signal });
  const page = (/** @type {StillDocument} */ still) =>
    html`<article class="dataset-page still-page">
      ${headOf(still, headParts(still, orders))}
      <div class="dataset-body">
        <div class="column">
          ${panel("Pictures", html`<div class="still-pictures">${picturesOf(still)}</div>`)}
          ${pairOf(still)}
        </div>
        <div class="column">
          ${panel("About", html`<div class="stack">${label(still.label)}<div>${figures(factRows(still))}</div></div>`)}
          ${panel("Cameras", html`<div>${still.cameras.map((camera) => cameraOf(camera, still))}</div>`)}
          ${panel("Check", check(still))}
          ${still.state === "kept" && still.trouble === "" && archive(still)}
        </div>
      </div>
    </article>`;
  return openEntry({ noun: NOUN, reader, page }, context);
}

/** @param {StillDocument} still @param {StillOrders} orders */
function headParts(still, orders) {
  const { id, name, state, trouble, url, warnings } = still;
  const readable = trouble === "";
  const wrong = readable ? missingWords(still) : [sentence(trouble)];
  const keep = () => void orders.keep(id, "");
  return {
    noun: NOUN,
    orders,
    word: archivedBadge(still),
    actions: [
      state === "held" && textButton("Keep", keep, { kind: "plain primary", picture: "check" }),
      readable &&
        html`<a class="plain" href="${url}/download.zip" download="${name}.zip">${icon("down")}Download ZIP</a>`,
    ],
    far: [...wrong, ...warnings.map(sentence)].map(
      (text) => html`<p class=${readable ? "strip warn" : "strip bad"}>${icon("warn")}${text}</p>`,
    ),
  };
}

/** @param {StillDocument} still */
function pairOf({ cameras, calibration_id, url }) {
  const both = cameras.filter(({ camera, came }) => camera !== "wide" && came > 0).length === 2;
  if (!both || calibration_id === null) return null;
  return panel(
    "Both eyes",
    html`<figure class="cover-map">
      <drawn-picture
        src="${url}/anaglyph.jpg" text="Both eyes, rectified, in red and cyan" width="720" height="540"
      ></drawn-picture>
      <figcaption>Rectified: left in red, right in green and blue.</figcaption>
    </figure>`,
  );
}

/** @param {StillDocument} still */
function factRows(still) {
  return filled([
    ["Taken", dayTime(still.created_utc)],
    ["What", stillWords(still)],
    ["Gazes cross", still.calibration_id === null ? "" : crossingWords(still)],
    ["Rail", still.rail_mm === null ? "" : `${number(still.rail_mm, 1)} mm`],
    ["Pan, tilt", still.pan_deg === null ? "" : `${angle(still.pan_deg)}, ${angle(still.tilt_deg)}`],
    ["Size", sizeWords(still.size_bytes)],
    ["Rig", still.rig_id ?? ""],
    ["Calibration", still.calibration_id ?? ""],
    ["Id", still.id],
    ["Folder", still.folder],
  ]);
}

/** @param {StillCamera} shown @param {StillDocument} still */
function cameraOf(shown, { url, name }) {
  const { camera, asked, came, width, height, bits, exposure_ms, gain_db, x_v, y_v, ax_deg, ay_deg } = shown;
  const rows = filled([
    ["Frames", came === asked ? String(came) : `${came} of ${asked}`],
    ["Size", came > 0 ? `${width} × ${height} px, ${bits} bits` : ""],
    ["Exposure", exposure_ms === null ? "" : millis(exposure_ms)],
    ["Gain", gain_db === null ? "" : `${number(gain_db, 1)} dB`],
    ["Looked", ax_deg === null ? "" : `${angle(ax_deg)} across, ${angle(ay_deg)} down`],
    ["Mirror", x_v === null ? "" : `${number(x_v, 2)} V, ${number(y_v, 2)} V`],
  ]);
  const file = (/** @type {string} */ form) =>
    html`<a class="plain" href="${url}/cameras/${camera}.${form}" download="${name} ${camera}.${form}">
      ${icon("down")}${bits > 8 ? "Full depth" : "Picture"}, ${form.toUpperCase()}
    </a>`;
  return html`<section class="still-camera">
    <h4>${CAMERAS[camera]}</h4>
    ${figures(rows)}${came > 0 && html`<p class="actions">${["png", "tiff"].map(file)}</p>`}
  </section>`;
}
