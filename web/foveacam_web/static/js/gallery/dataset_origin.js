// Shows the origin of a dataset: its plan, the rig's settings, and its calibration.

import { badge, figures, nothing } from "../calibration/parts.js";
import { addressOf } from "../calibration/route.js";
import { changing, h } from "../dom.js";
import { conditionRows, planWords } from "./dataset_words.js";

/**
 * @import { CaptureDocument } from "#api"
 * @import { Store } from "../store.js"
 */

/** @param {Record<string, unknown> | null} plan */
export function planOf(plan) {
  const words = planWords(plan);
  return [
    words.length > 0
      ? h(
          "ul",
          { class: "sentences" },
          words.map((text) => h("li", { text })),
        )
      : nothing("It says nothing of its plan."),
    asWritten("The plan as it is written", plan),
  ];
}

/** @param {Record<string, unknown> | null} conditions */
export function conditionsOf(conditions) {
  const rows = conditionRows(conditions);
  return [
    rows.length > 0 ? figures(rows) : nothing("It says nothing of what the rig ran with."),
    asWritten("The conditions as they are written", conditions),
  ];
}

/**
 * @param {string} title
 * @param {Record<string, unknown> | null} document
 */
function asWritten(title, document) {
  if (!document || Object.keys(document).length === 0) return null;
  return h(
    "details",
    {},
    h("summary", { text: title }),
    h("pre", { class: "code scroll-x", tabindex: "0", text: JSON.stringify(document, null, 1) }),
  );
}

/**
 * @param {Store} store
 * @param {AbortSignal} signal
 */
export function makeCalibration(store, signal) {
  const element = h("div", { class: "stack" });
  const show = changing(element, calibrationOf);
  let id = /** @type {string | null} */ (null);
  const update = () => show({ id, in_use: store.state.rig?.calibration?.id ?? null });
  store.on(["rig"], update, signal);
  return {
    element,
    show: (/** @type {CaptureDocument} */ dataset) => {
      id = dataset.calibration_id;
      update();
    },
  };
}

/** @param {{id: string | null, in_use: string | null}} now */
function calibrationOf({ id, in_use }) {
  if (id === null) return [nothing("It was taken without a calibration: no rectified pairs, no anaglyphs.")];
  const word =
    in_use === null ? null : id === in_use ? badge("good", "in use now") : badge("plain", "another one is in use now");
  return [
    h("p", { class: "facts" }, h("span", { class: "number", text: id.slice(0, 10), title: id }), word),
    h(
      "p",
      { class: "lead" },
      "Embedded in the dataset, whole: it is rectified by this one, whatever the rig uses. ",
      h("a", { href: addressOf("overview"), text: "Calibrations" }),
      ".",
    ),
  ];
}
