// The page of one dataset: contact sheet, coverage, details, checks and files.

import { badge, figures, nothing, panel, textButton } from "../../elements/parts.js";
import { fresh } from "../../calibrating/calibration/pictures.js";
import { wizardAddress } from "../../addresses.js";
import { copiedCode } from "../../elements/copy.js";
import { html } from "../../elements/dom.js";
import { sentence } from "../../elements/format.js";
import { icon } from "../../elements/icons.js";
import { isNamed } from "../../operating/session/words.js";
import { ROOT } from "../../root.js";
import { archivedBadge, makeArchive } from "./archive.js";
import { headOf, makeCheck } from "./collection.js";
import { makeSheet } from "./dataset_sheet.js";
import { conditionRows, factRows, isLive, localLines, planWords, remoteLines, stateWords } from "./dataset_words.js";
import { progressOf } from "./datasets.js";
import { makeEditable, saveOf } from "./editable.js";
import { makeExports } from "./exports.js";
import { makeMosaicLink } from "./mosaic/link.js";
import { openMosaic } from "./mosaic/page.js";
import { makeReference } from "./reference.js";

/**
 * @import { CaptureDocument, PointsDocument, SignInDocument } from "#api"
 * @import { Noun } from "./collection.js"
 * @import { DatasetOrders, DatasetReader } from "./datasets.js"
 * @import { GalleryContext, GalleryTab } from "./page.js"
 */

/**
 * The further pages about one dataset, at #/gallery/datasets/ID/PART, in the form of the gallery's tabs.
 * @type {readonly GalleryTab[]}
 */
export const DATASET_PARTS = Object.freeze([{ name: "mosaic", title: "Mosaic", open: openMosaic }]);
const LICENCES = ["all rights reserved", "CC BY 4.0", "CC BY-SA 4.0", "CC0 1.0"];

/**
 * Return a function that shows a dataset.
 * @param {string} id
 * @param {{noun: Noun, orders: DatasetOrders, reader: DatasetReader, context: GalleryContext}} tools
 */
export function makeDatasetPage(id, { noun, orders, reader, context }) {
  const { store, signal } = context;
  const entry = { orders, reader };
  const label = makeEditable("Label", { save: saveOf("label", id, entry), hint: "a line for people" });
  const licence = makeEditable("Licence", { save: saveOf("licence", id, entry), usual: LICENCES });
  const check = makeCheck(orders, () => reader.changed());
  const archive = makeArchive({ orders, reader, signal });
  const again = () => reader.entry && reader.changed();
  const reference = makeReference(id, context, again);
  const exports = makeExports(id, context, again);
  const mosaic = makeMosaicLink(id, context, again);
  const sheet = makeSheet(signal);
  store.on(["rig"], again, signal);
  return (/** @type {CaptureDocument} */ dataset) => {
    const { points } = reader;
    const taken = points !== null && points.points.length > 0;
    const described = dataset.state !== "damaged" && dataset.state !== "starting";
    return html`<article class="dataset-page">
      ${headOf(dataset, headParts(dataset, { noun, orders, exported: exports.button, mosaic }))}
      <div>${canExport(dataset) && exports.shown()}</div>
      <div class="dataset-body">
        <div class="column">
          ${!taken && nothing(emptyWords(dataset))}
          ${taken && panel("Contact sheet", sheet(dataset, points))}
          ${taken && panel("Coverage", coverageOf(dataset, points))}
          ${reference()}
        </div>
        <div class="column">
          ${panel(
            "About",
            html`<div class="stack">
              ${described && [label(dataset.label), licence(dataset.licence)]}
              <div>${figures(factRows(dataset))}</div>
            </div>`,
          )}
          ${panel("Check", check(dataset))}
          ${described && !isLive(dataset) && archive(dataset)}
          ${
            points && [
              taken && panel("In Python", python(dataset, store.state.sign_in)),
              panel("Plan", html`<div class="stack">${planOf(dataset.plan)}</div>`),
              panel("Conditions", html`<div class="stack">${conditionsOf(dataset.conditions)}</div>`),
              panel("Calibration", calibrationOf(dataset.calibration_id, store.state.rig?.calibration?.id ?? null)),
            ]
          }
        </div>
      </div>
    </article>`;
  };
}

/** @param {CaptureDocument} dataset */
function canExport(dataset) {
  return dataset.state !== "damaged" && !isLive(dataset) && dataset.points.taken > 0;
}

/**
 * @param {CaptureDocument} dataset
 * @param {{noun: Noun, orders: DatasetOrders, exported: () => unknown, mosaic: () => unknown}} tools
 */
function headParts(dataset, { noun, orders, exported, mosaic }) {
  const { id, name, state, resumable, url, points, why } = dataset;
  const live = isLive(dataset);
  const readable = state !== "damaged" && !live;
  const { tone, text } = stateWords(dataset);
  const resume = async () => {
    if (await orders.resume(id)) location.hash = "#/capture";
  };
  const strip = () =>
    html`<p class=${state === "damaged" ? "strip bad" : "strip warn"}>${icon("warn")}${sentence(why)}</p>`;
  return {
    noun,
    orders,
    word: [badge(tone, text), archivedBadge(dataset)],
    busy: live ? "Not while it runs" : "",
    actions: [
      live && html`<a class="plain primary" href="#/capture">Watch it</a>`,
      resumable &&
        textButton("Resume", resume, {
          kind: "plain primary",
          picture: "again",
          title: "Take what is missing, from the exact next point",
        }),
      readable && points.taken > 0 && mosaic(),
      readable &&
        html`<a class="plain" href="${url}/download.zip" download="${name}.zip">${icon("down")}Download ZIP</a>`,
      canExport(dataset) && exported(),
    ],
    far: live ? progressOf(dataset, "Progress") : why !== "" && strip(),
  };
}

/** @param {CaptureDocument} dataset */
function emptyWords({ state }) {
  return state === "damaged"
    ? "Its pictures are not shown, as it cannot be read. Its files were left alone."
    : "Nothing was taken yet.";
}

/** @param {CaptureDocument} dataset @param {PointsDocument} points */
function coverageOf({ url }, { points }) {
  return html`<figure class="cover-map">
    <drawn-picture
      src=${fresh(`${url}/coverage.jpg`, String(points.length))} width="720" height="540"
      text="Coverage: the wide view with the outlines of all foveae"
    ></drawn-picture>
    <figcaption>The wide view at the middle of the plan, and what each fovea saw: left red, right cyan.</figcaption>
  </figure>`;
}

/** @param {Record<string, unknown> | null} plan */
function planOf(plan) {
  const words = planWords(plan);
  return [
    words.length > 0
      ? html`<ul class="sentences">${words.map((text) => html`<li>${text}</li>`)}</ul>`
      : nothing("The dataset contains no plan."),
    asWritten("The plan as it is written", plan),
  ];
}

/** @param {Record<string, unknown> | null} conditions */
function conditionsOf(conditions) {
  const rows = conditionRows(conditions);
  return [
    rows.length > 0 ? figures(rows) : nothing("The dataset contains no conditions of the rig."),
    asWritten("The conditions as they are written", conditions),
  ];
}

/** @param {string} title @param {Record<string, unknown> | null} document */
function asWritten(title, document) {
  if (!document || Object.keys(document).length === 0) return null;
  return html`<details>
    <summary>${title}</summary>
    <pre class="code scroll-x" tabindex="0">${JSON.stringify(document, null, 1)}</pre>
  </details>`;
}

/** @param {string | null} id @param {string | null} in_use */
function calibrationOf(id, in_use) {
  if (id === null) return nothing("It was taken without a calibration: no rectified pairs, no anaglyphs.");
  const word =
    in_use !== null && (id === in_use ? badge("good", "in use now") : badge("plain", "another one is in use now"));
  return html`<div class="stack">
    <p class="facts"><span class="number" title=${id}>${id.slice(0, 10)}</span>${word}</p>
    <p class="lead">
      Embedded in the dataset, whole: it is rectified by this one, whatever the rig uses.
      ${" "}<a href=${wizardAddress("overview")}>Calibrations</a>.
    </p>
  </div>`;
}

/** @param {CaptureDocument} dataset @param {SignInDocument | null} sign_in */
function python(dataset, sign_in) {
  const address = `${location.origin}${ROOT}`;
  return html`<div class="stack">
    ${copiedCode(remoteLines(dataset, { address, named: isNamed(sign_in) }), "Python")}
    <p class="note">
      On any machine that reaches ${address}. It needs the client alone, from the sources of FoveaCam Duo:${" "}
      <code>pip install './server/foveacam_client[arrays]'</code>
    </p>
    <details>
      <summary>On the server's own machine</summary>
      <div class="stack">${copiedCode(localLines(dataset), "Python on the server's own machine")}</div>
    </details>
  </div>`;
}
