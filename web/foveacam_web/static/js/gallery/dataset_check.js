// Checks every file of a dataset on request, and shows the server's sentences.

import { fill, h, say } from "../dom.js";
import { count } from "../format.js";
import { icon } from "../icons.js";
import { sizeWords } from "./dataset_words.js";

/**
 * @import { CaptureChecked, CaptureDocument } from "#api"
 * @import { DatasetOrders } from "./dataset_orders.js"
 */

const MOST = 20;

/** @param {DatasetOrders} orders */
export function makeCheck(orders) {
  /** @type {CaptureDocument | null} */
  let now = null;
  const [found, told] = [h("div", { class: "stack", role: "status" }), h("span", { class: "why" })];
  const act = async () => {
    if (!now) return;
    button.disabled = true;
    fill(found);
    say(told, now.size_bytes > 0 ? `Reading ${sizeWords(now.size_bytes)} …` : "Reading …");
    const checked = await orders.check(now.id);
    button.disabled = false;
    say(told, "");
    if (checked) fill(found, ...resultOf(checked));
  };
  const button = h(
    "button",
    { type: "button", class: "plain", on: { click: () => void act() } },
    icon("check"),
    "Check every file",
  );
  const element = h("div", { class: "stack" }, h("p", { class: "actions" }, button, told), found);
  return {
    element,
    show: (/** @type {CaptureDocument} */ dataset) => {
      now = dataset;
    },
  };
}

/** @param {CaptureChecked} checked */
function resultOf({ sound, faults }) {
  if (sound)
    return [h("p", { class: "state good" }, icon("check"), "Every file, size, hash and row is as it was written.")];
  return [
    h(
      "p",
      { class: "state bad" },
      icon("warn"),
      faults.length === 1
        ? "One thing is not as it was written:"
        : `${count(faults.length)} things are not as they were written:`,
    ),
    h(
      "ul",
      { class: "sentences" },
      faults.slice(0, MOST).map((text) => h("li", { text })),
      faults.length > MOST && h("li", { text: `… and ${count(faults.length - MOST)} more.` }),
    ),
  ];
}
