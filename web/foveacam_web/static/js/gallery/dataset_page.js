// The page of one dataset: contact sheet, coverage, details, checks and files.

import { nothing, panel } from "../calibration/parts.js";
import { fresh } from "../calibration/pictures.js";
import { changing, fill, h } from "../dom.js";
import { sentence } from "../format.js";
import { makeAbout } from "./dataset_about.js";
import { makeCheck } from "./dataset_check.js";
import { makeHead } from "./dataset_head.js";
import { DatasetOrders } from "./dataset_orders.js";
import { conditionsOf, makeCalibration, planOf } from "./dataset_origin.js";
import { DatasetReader } from "./dataset_reader.js";
import { makeSheet } from "./dataset_sheet.js";
import { makeDrawn } from "./drawn.js";
import { makeReference } from "./reference.js";
import { galleryAddress } from "./route.js";
import { makeSnippet } from "./snippet.js";

/**
 * @import { CaptureDocument, PointsDocument } from "#api"
 * @import { GalleryContext } from "./tabs.js"
 * @typedef {{element: HTMLElement, show: (dataset: CaptureDocument) => void}} Part
 */

/**
 * @param {string} id
 * @param {GalleryContext} context
 */
export function openDataset(id, context) {
  const reader = new DatasetReader(id, () => show());
  const orders = new DatasetOrders(context);
  const page = makePage(orders, reader, context, makeReference(id, context));
  const place = h("div", { class: "dataset" }, nothing("Loading …"));
  const show = () => {
    const { dataset, points, missing } = reader;
    if (dataset === null) return fill(place, ...missingOf(missing));
    if (place.firstChild !== page.element) fill(place, page.element);
    page.show(dataset, points);
  };
  context.follow(reader);
  return place;
}

/** @param {string} missing */
function missingOf(missing) {
  return [
    nothing(sentence(missing)),
    h(
      "p",
      { class: "lead" },
      "It may be in the trash. ",
      h("a", { href: galleryAddress("datasets"), text: "To the datasets" }),
      ".",
    ),
  ];
}

/**
 * @param {DatasetOrders} orders
 * @param {DatasetReader} reader
 * @param {GalleryContext} context
 * @param {HTMLElement} reference
 */
function makePage(orders, reader, { store, signal }, reference) {
  const pictures = makePictures(signal, reference);
  const [head, about, check, python, calibration] = [
    makeHead(orders),
    makeAbout(orders, reader),
    makeCheck(orders),
    makeSnippet(),
    makeCalibration(store, signal),
  ];
  const [plan, conditions] = [h("div", { class: "stack" }), h("div", { class: "stack" })];
  const showPlan = changing(plan, planOf);
  const showConditions = changing(conditions, conditionsOf);
  const readable = [
    panel("In Python", python.element),
    panel("Plan", plan),
    panel("Conditions", conditions),
    panel("Calibration", calibration.element),
  ];
  const element = h(
    "article",
    { class: "dataset-page" },
    head.element,
    h(
      "div",
      { class: "dataset-body" },
      pictures.element,
      h("div", { class: "column" }, panel("About", about.element), panel("Check", check.element), readable),
    ),
  );
  return {
    element,
    show: (/** @type {CaptureDocument} */ dataset, /** @type {PointsDocument | null} */ points) => {
      for (const part of [head, about, check, python, calibration]) part.show(dataset);
      showPlan(dataset.plan);
      showConditions(dataset.conditions);
      for (const each of readable) each.hidden = points === null;
      pictures.show(dataset, points);
    },
  };
}

/**
 * @param {AbortSignal} signal
 * @param {HTMLElement} reference
 */
function makePictures(signal, reference) {
  const sheet = makeSheet(signal);
  const coverage = makeDrawn({ width: 720, height: 540 });
  const none = h("div", { class: "stack" });
  const showNone = changing(none, (/** @type {string} */ words) => (words === "" ? [] : [nothing(words)]));
  const panels = [
    panel("Contact sheet", sheet.element),
    panel(
      "Coverage",
      h(
        "figure",
        { class: "cover-map" },
        coverage.element,
        h("figcaption", {
          text: "The wide view at the middle of the plan, and what each fovea saw: left red, right cyan.",
        }),
      ),
    ),
  ];
  return {
    element: h("div", { class: "column" }, none, panels, reference),
    show: (/** @type {CaptureDocument} */ dataset, /** @type {PointsDocument | null} */ points) => {
      const empty = points === null || points.points.length === 0;
      showNone(
        !empty
          ? ""
          : dataset.state === "damaged"
            ? "Its pictures are not shown, as it cannot be read. Its files were left alone."
            : "Nothing was taken yet.",
      );
      for (const each of panels) each.hidden = empty;
      if (points === null || empty) return;
      sheet.show(dataset, points);
      coverage.show(
        fresh(`${dataset.url}/coverage.jpg`, String(points.points.length)),
        "Coverage: the wide view with the outlines of all foveae",
      );
    },
  };
}
