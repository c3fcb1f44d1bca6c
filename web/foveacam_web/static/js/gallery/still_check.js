// Checks every file of a still on request, and shows the server's sentences.

import { fill, h } from "../dom.js";
import { sentence } from "../format.js";
import { icon } from "../icons.js";

/**
 * @import { StillCheck, StillDocument } from "#api"
 * @import { StillOrders } from "../capture/still_orders.js"
 */

/** @param {StillOrders} orders */
export function makeStillCheck(orders) {
  /** @type {StillDocument | null} */
  let now = null;
  const found = h("div", { class: "stack", role: "status" });
  const act = async () => {
    if (!now) return;
    button.disabled = true;
    fill(found);
    const checked = await orders.check(now.id);
    button.disabled = false;
    if (checked) fill(found, ...resultOf(checked));
  };
  const button = h(
    "button",
    { type: "button", class: "plain", on: { click: () => void act() } },
    icon("check"),
    "Check every file",
  );
  return {
    element: h("div", { class: "stack" }, h("p", { class: "actions" }, button), found),
    show: (/** @type {StillDocument} */ still) => {
      now = still;
    },
  };
}

/** @param {StillCheck} checked */
function resultOf({ sound, faults }) {
  if (sound)
    return [h("p", { class: "state good" }, icon("check"), "Every file, size, hash and row is as it was written.")];
  return [
    h("p", { class: "state bad" }, icon("warn"), "Not all is as it was written:"),
    h(
      "ul",
      { class: "sentences" },
      faults.map((text) => h("li", { text: sentence(text) })),
    ),
  ];
}
