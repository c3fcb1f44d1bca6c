// Shows a dataset's figures, and its label and licence, which can be edited.

import { figures } from "../calibration/parts.js";
import { changing, h } from "../dom.js";
import { count } from "../format.js";
import { pointsWords, sizeWords, whenWords } from "./dataset_words.js";
import { makeEditable } from "./editable.js";

/**
 * @import { CaptureDocument } from "#api"
 * @import { DatasetOrders } from "./dataset_orders.js"
 * @import { DatasetReader } from "./dataset_reader.js"
 */

const LICENCES = ["all rights reserved", "CC BY 4.0", "CC BY-SA 4.0", "CC0 1.0"];

/**
 * @param {DatasetOrders} orders
 * @param {DatasetReader} reader
 */
export function makeAbout(orders, reader) {
  const saver = (/** @type {"label" | "licence"} */ key) => async (/** @type {string} */ value) => {
    const { dataset } = reader;
    const now = dataset && (await orders.describe(dataset.id, { [key]: value }));
    if (now) reader.adopt(now);
    return Boolean(now);
  };
  const label = makeEditable("Label", { save: saver("label"), hint: "a line for people" });
  const licence = makeEditable("Licence", { save: saver("licence"), usual: LICENCES });
  const facts = h("div", {});
  const showFacts = changing(facts, factsOf);
  return {
    element: h("div", { class: "stack" }, label.element, licence.element, facts),
    show: (/** @type {CaptureDocument} */ dataset) => {
      label.show(dataset.label);
      licence.show(dataset.licence);
      for (const { element } of [label, licence])
        element.hidden = dataset.state === "damaged" || dataset.state === "starting";
      showFacts({ ...dataset, progress: null });
    },
  };
}

/** @param {CaptureDocument} dataset */
function factsOf(dataset) {
  const { scans, frames } = dataset.points;
  return [
    figures(
      /** @type {[string, string][]} */ ([
        ["Taken", whenWords(dataset.created_utc)],
        ["Points", pointsWords(dataset)],
        [
          "Pictures",
          frames > 0 ? [count(frames), scans > 1 && `in ${count(scans)} scans`].filter(Boolean).join(" ") : "",
        ],
        ["Size", dataset.size_bytes > 0 ? sizeWords(dataset.size_bytes) : ""],
        ["Format", dataset.codec ? dataset.codec.toUpperCase() : ""],
        ["Rig", dataset.rig_id ?? ""],
        ["Id", dataset.id],
        ["Folder", dataset.folder],
      ]).filter(([, value]) => value !== ""),
    ),
  ];
}
