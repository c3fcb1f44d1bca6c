// The head of a dataset's page: name, state, and buttons.

import { badge, bar } from "../calibration/parts.js";
import { changing, h } from "../dom.js";
import { sentence } from "../format.js";
import { icon } from "../icons.js";
import { DATASET_PARTS } from "./dataset_parts.js";
import { isLive, progressWords, stateWords } from "./dataset_words.js";
import { galleryAddress } from "./route.js";

/**
 * @import { CaptureDocument } from "#api"
 * @import { DatasetOrders } from "./dataset_orders.js"
 * @typedef {Pick<CaptureDocument, "id" | "name" | "state" | "resumable" | "url"> & {begun: boolean}} Deed what the buttons go by
 */

/** @param {DatasetOrders} orders */
export function makeHead(orders) {
  const [name, actions, far] = [
    h("div", { class: "name" }),
    h("div", { class: "actions" }),
    h("div", { class: "far" }),
  ];
  const showName = changing(name, nameOf);
  const showActions = changing(actions, (/** @type {Deed} */ dataset) => actionsOf(dataset, orders));
  const showFar = changing(far, farOf);
  return {
    element: h("header", { class: "dataset-head" }, name, actions, far),
    show: (/** @type {CaptureDocument} */ dataset) => {
      showName({ name: dataset.name, word: stateWords(dataset) });
      // only these, so that no click is lost when something else changes
      const { id, name: named, state, resumable, url, points } = dataset;
      showActions({ id, name: named, state, resumable, url, begun: points.taken > 0 });
      showFar(dataset);
    },
  };
}

/** @param {{name: string, word: {tone: string, text: string}}} now */
function nameOf({ name, word }) {
  return [
    h(
      "a",
      {
        class: "tool",
        href: galleryAddress("datasets"),
        "aria-label": "Back to the datasets",
        title: "Back to the datasets",
      },
      icon("back"),
    ),
    h("h3", { text: name, tabindex: "-1" }),
    badge(word.tone, word.text),
  ];
}

/**
 * @param {Deed} dataset
 * @param {DatasetOrders} orders
 */
function actionsOf(dataset, orders) {
  const live = isLive(dataset);
  const readable = dataset.state !== "damaged" && !live;
  const resume = async () => {
    if (await orders.resume(dataset.id)) location.hash = "#/capture";
  };
  const remove = async () => {
    if (await orders.trash.remove(dataset)) location.hash = galleryAddress("datasets");
  };
  return [
    live && h("a", { class: "plain primary", href: "#/capture" }, "Watch it"),
    dataset.resumable &&
      h(
        "button",
        {
          type: "button",
          class: "plain primary",
          data: { keep: "resume" },
          title: "Take what is missing, from the exact next point",
          on: { click: () => void resume() },
        },
        icon("again"),
        "Resume",
      ),
    ...(readable && dataset.begun
      ? DATASET_PARTS.map(({ name, title }) =>
          h("a", { class: "plain", href: galleryAddress("datasets", dataset.id, name), text: title }),
        )
      : []),
    readable &&
      h(
        "a",
        { class: "plain", href: `${dataset.url}/download.zip`, download: `${dataset.name}.zip` },
        icon("down"),
        "Download ZIP",
      ),
    h(
      "button",
      {
        type: "button",
        class: "plain",
        data: { keep: "remove" },
        disabled: live,
        title: live ? "Not while it runs" : "It can be restored until the trash is emptied",
        on: { click: () => void remove() },
      },
      icon("trash"),
      "Put in the trash",
    ),
  ];
}

/** @param {CaptureDocument} dataset */
function farOf(dataset) {
  if (!isLive(dataset))
    return dataset.why === ""
      ? []
      : [
          h(
            "p",
            { class: dataset.state === "damaged" ? "strip bad" : "strip warn" },
            icon("warn"),
            sentence(dataset.why),
          ),
        ];
  const { progress } = dataset;
  const words = progressWords(dataset);
  const share = progress && progress.total > 0 && progress.phase !== "survey" ? progress.done / progress.total : null;
  return [bar("Progress", { share, text: words }), h("p", { class: "note", text: words })];
}
