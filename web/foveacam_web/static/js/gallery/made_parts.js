// Shows the making of a mosaic or a reference: why it cannot be made, its progress, why the last attempt failed.

import { bar } from "../calibration/parts.js";
import { h } from "../dom.js";
import { sentence } from "../format.js";
import { icon } from "../icons.js";
import { leftOf } from "./mosaic_words.js";

/** @import { JobProgress, Problem } from "#api" */

/**
 * @param {Problem} problem
 * @param {{forget: () => void}} reader
 * @param {string} noun
 */
export function troubleOf(problem, reader, noun) {
  return [
    h(
      "div",
      { class: "strip bad", role: "alert" },
      icon("warn"),
      h("div", {}, h("strong", { text: `The last ${noun} was not finished. ` }), sentence(problem.detail)),
      h(
        "button",
        { type: "button", class: "tool", "aria-label": "Dismiss", on: { click: () => reader.forget() } },
        icon("close"),
      ),
    ),
  ];
}

/**
 * @param {Problem} problem
 * @param {string} noun
 */
export function refusalOf({ detail }, noun) {
  return [
    h(
      "div",
      { class: "strip warn", role: "status" },
      icon("warn"),
      h("div", {}, h("strong", { text: `No ${noun} can be made of it. ` }), sentence(detail)),
    ),
  ];
}

/**
 * @param {JobProgress | null} progress
 * @param {{cancel: () => unknown}} orders
 * @param {string} noun
 */
export function progressOf(progress, orders, noun) {
  const share = progress && progress.total > 0 && progress.done > 0 ? progress.done / progress.total : null;
  const note = progress?.note ? sentence(progress.note).slice(0, -1) : "Reading the dataset";
  const words = [
    note,
    share === null ? "" : `step ${progress?.done} of ${progress?.total}`,
    leftOf(progress?.eta_s ?? null),
  ]
    .filter(Boolean)
    .join(" · ");
  return [
    h(
      "div",
      { class: "job running" },
      h("div", { class: "words", text: words }),
      h("div", { class: "progress" }, bar(`Making the ${noun}`, { share, text: words })),
      h(
        "button",
        { type: "button", class: "plain", data: { keep: "cancel" }, on: { click: () => void orders.cancel() } },
        "Cancel",
      ),
    ),
  ];
}
