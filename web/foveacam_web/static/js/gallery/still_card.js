// A still's card: picture, name, frames.

import { missingWords, stillWords } from "../capture/still_words.js";
import { h } from "../dom.js";
import { sentence } from "../format.js";
import { icon } from "../icons.js";
import { sizeWords, whenWords } from "./dataset_words.js";
import { makeDrawn } from "./drawn.js";
import { galleryAddress } from "./route.js";

/**
 * @import { StillDocument } from "#api"
 * @import { StillOrders } from "../capture/still_orders.js"
 */

/**
 * @param {StillDocument} still
 * @param {StillOrders} orders
 */
export function stillCard(still, orders) {
  const { id, name, label, trouble, created_utc, size_bytes, state } = still;
  const removed = state === "removed";
  const words = h(
    "div",
    { class: "words" },
    label !== "" && h("p", { class: "label", text: label }),
    trouble === "" &&
      h(
        "p",
        { class: "still-facts" },
        h("span", { text: `${stillWords(still)} · ` }),
        h("span", { class: "number", text: sizeWords(size_bytes) }),
      ),
    [trouble, ...missingWords(still)]
      .filter((text) => text !== "")
      .map((text) => h("p", { class: "reason", text: sentence(text) })),
    created_utc !== null &&
      h("p", { class: "when" }, h("time", { datetime: created_utc, text: whenWords(created_utc) })),
  );
  return h(
    "li",
    { class: "card", data: { state: trouble === "" ? state : "damaged", still: id } },
    h("div", { class: "card-cover" }, coverOf(still)),
    h(
      "h3",
      {},
      removed
        ? h("span", { text: name, title: name })
        : h("a", { href: galleryAddress("stills", id), title: name, text: name, data: { keep: `name ${id}` } }),
    ),
    words,
    h("div", { class: "tools" }, toolOf(still, orders)),
  );
}

/** @param {StillDocument} still */
function coverOf({ state, trouble, url }) {
  const why = state === "removed" ? "In the trash" : trouble === "" ? "" : "No picture: it cannot be read";
  if (why !== "") return h("p", { class: "blank", text: why });
  const drawn = makeDrawn({ lazy: true, width: 320, height: 240 });
  drawn.show(`${url}/thumbnail.jpg`, "");
  return drawn.element;
}

/**
 * @param {StillDocument} still
 * @param {StillOrders} orders
 */
function toolOf(still, orders) {
  const { id, name, state } = still;
  if (state === "removed")
    return h(
      "button",
      {
        type: "button",
        class: "plain",
        data: { keep: `tool ${id}` },
        "aria-label": `Restore ${name}`,
        on: { click: () => void orders.trash.restore(still) },
      },
      icon("again"),
      "Restore",
    );
  return h(
    "button",
    {
      type: "button",
      class: "tool",
      data: { keep: `tool ${id}` },
      "aria-label": `Put ${name} in the trash`,
      title: "Put it in the trash",
      on: { click: () => void orders.trash.remove(still) },
    },
    icon("trash"),
  );
}
