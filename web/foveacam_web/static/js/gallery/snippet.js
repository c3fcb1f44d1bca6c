// Shows the lines of Python that load a dataset, with its real path.

import { changing, h, say } from "../dom.js";
import { icon } from "../icons.js";

/** @import { CaptureDocument } from "#api" */

/** @param {CaptureDocument} dataset */
export function snippet({ folder, points, calibration_id }) {
  const calibrated = calibration_id !== null;
  return [
    "from foveacam_pipeline.capture.dataset import Dataset",
    `dataset = Dataset.open(${JSON.stringify(folder)})`,
    `point = dataset[${Math.floor(points.taken / 2)}]`,
    `print(len(dataset), point.left.shape, ${calibrated ? "point.pose.left_rad, dataset.calibration.id" : "point.right.shape"})`,
    calibrated ? "pair = point.rectified(scale=0.5)" : "wide = point.wide",
  ].join("\n");
}

export function makeSnippet() {
  const element = h("div", { class: "stack" });
  const show = changing(element, (/** @type {string} */ text) => {
    const code = h("pre", { class: "code scroll-x", tabindex: "0", "aria-label": "Python", text });
    const told = h("span", { class: "why", role: "status" });
    const copy = h(
      "button",
      { type: "button", class: "plain", data: { keep: "copy" }, on: { click: () => void copyOf(code, told) } },
      icon("file"),
      "Copy",
    );
    return [code, h("p", { class: "actions" }, copy, told)];
  });
  return { element, show: (/** @type {CaptureDocument} */ dataset) => show(snippet(dataset)) };
}

/**
 * @param {HTMLElement} code
 * @param {HTMLElement} told
 */
async function copyOf(code, told) {
  try {
    await navigator.clipboard.writeText(code.textContent ?? "");
    say(told, "Copied");
  } catch {
    getSelection()?.selectAllChildren(code); // no clipboard over plain HTTP from another machine
    say(told, "Selected: copy it with the keyboard");
  }
}
