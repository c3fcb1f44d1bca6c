// A dataset's card: picture, name, state. Parts that did not change keep their elements, above all the pictures.

import { badge, bar } from "../calibration/parts.js";
import { fresh } from "../calibration/pictures.js";
import { changing, fill, h, say } from "../dom.js";
import { sentence } from "../format.js";
import { icon } from "../icons.js";
import { isLive, pointsWords, progressWords, sizeWords, stateWords, whenWords } from "./dataset_words.js";
import { makeDrawn } from "./drawn.js";
import { galleryAddress } from "./route.js";

/**
 * @import { CaptureDocument } from "#api"
 * @import { DatasetOrders } from "./dataset_orders.js"
 * @typedef {{element: HTMLElement, show: (dataset: CaptureDocument) => void}} Card
 */

const WIDTH_PX = 320;
const HEIGHT_PX = 240;
const NO_POINTS = Object.freeze({ planned: 0, taken: 0, skipped: 0, scans: 0, frames: 0 });

/**
 * @param {DatasetOrders} orders
 * @returns {Card}
 */
export function makeCard(orders) {
  const cover = h("div", { class: "card-cover" });
  const [name, words, tools, progress] = [
    h("h3", {}),
    h("div", { class: "words" }),
    h("div", { class: "tools" }),
    h("div", { class: "far" }),
  ];
  const showCover = coverOf(cover);
  const showName = changing(name, nameOf);
  const showWords = changing(words, wordsOf);
  const showTools = changing(tools, (/** @type {CaptureDocument} */ dataset) => toolsOf(dataset, orders));
  const showProgress = changing(progress, progressOf);
  const element = h("li", { class: "card" }, cover, name, words, progress, tools);
  return {
    element,
    show: (dataset) => {
      element.dataset["state"] = dataset.state;
      showCover(dataset);
      const still = { ...dataset, progress: null, why: isLive(dataset) ? "" : dataset.why };
      showName(still);
      showWords(still);
      showTools({ ...still, points: NO_POINTS, size_bytes: 0 });
      showProgress(dataset);
    },
  };
}

/** @param {HTMLElement} place */
function coverOf(place) {
  const drawn = makeDrawn({ lazy: true, width: WIDTH_PX, height: HEIGHT_PX });
  const blank = h("p", { class: "blank" });
  return (/** @type {CaptureDocument} */ dataset) => {
    const why = dataset.removed
      ? "In the trash"
      : dataset.state === "damaged"
        ? "No picture: it cannot be read"
        : dataset.points.taken === 0
          ? "Nothing taken yet"
          : "";
    if (why === "") drawn.show(fresh(`${dataset.url}/thumbnail.jpg`, String(dataset.points.taken)), "");
    say(blank, why);
    const shown = why === "" ? drawn.element : blank;
    if (place.firstChild !== shown) fill(place, shown);
  };
}

/** @param {CaptureDocument} dataset */
function nameOf({ id, name, removed }) {
  if (removed) return [h("span", { text: name, title: name })];
  return [h("a", { href: galleryAddress("datasets", id), title: name, text: name, data: { keep: "name" } })];
}

/** @param {CaptureDocument} dataset */
function wordsOf(dataset) {
  const { text, tone } = stateWords(dataset);
  const ended = !isLive(dataset) && dataset.why !== "";
  return [
    dataset.label !== "" && h("p", { class: "label", text: dataset.label }),
    h(
      "p",
      { class: "facts" },
      badge(tone, text),
      [pointsWords(dataset), dataset.size_bytes > 0 ? sizeWords(dataset.size_bytes) : ""]
        .filter(Boolean)
        .map((words) => h("span", { class: "number", text: words })),
    ),
    ended && h("p", { class: "reason", text: sentence(dataset.why) }),
    h(
      "p",
      { class: "when" },
      dataset.created_utc !== null &&
        h("time", { datetime: dataset.created_utc, text: whenWords(dataset.created_utc) }),
    ),
  ];
}

/**
 * @param {CaptureDocument} dataset
 * @param {DatasetOrders} orders
 */
function toolsOf(dataset, orders) {
  if (dataset.removed)
    return [
      h(
        "button",
        {
          type: "button",
          class: "plain",
          data: { keep: "tool" },
          "aria-label": `Restore ${dataset.name}`,
          on: { click: () => void orders.trash.restore(dataset) },
        },
        icon("again"),
        "Restore",
      ),
    ];
  const live = isLive(dataset);
  return [
    h(
      "button",
      {
        type: "button",
        class: "tool",
        data: { keep: "tool" },
        "aria-label": `Put ${dataset.name} in the trash`,
        title: live ? "Not while it runs" : "Put it in the trash",
        disabled: live,
        on: { click: () => void orders.trash.remove(dataset) },
      },
      icon("trash"),
    ),
  ];
}

/** @param {CaptureDocument} dataset */
function progressOf(dataset) {
  if (!isLive(dataset)) return [];
  const { progress } = dataset;
  const words = progressWords(dataset);
  const share = progress && progress.total > 0 && progress.phase !== "survey" ? progress.done / progress.total : null;
  return [bar(`Progress of ${dataset.name}`, { share, text: words }), h("p", { class: "note", text: words })];
}
