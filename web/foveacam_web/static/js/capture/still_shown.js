// Shows the last still that is neither kept nor discarded: its pictures, missing frames, keep and discard buttons.

import { changing, h } from "../dom.js";
import { count } from "../format.js";
import { icon } from "../icons.js";
import { makeDrawn } from "../gallery/drawn.js";
import { cameraWords, CAMERAS, missingWords } from "./still_words.js";
import { textField } from "./parts.js";

/**
 * @import { StillDocument } from "#api"
 * @import { StillOrders } from "./still_orders.js"
 * @typedef {{still: StillDocument, waiting: number} | null} Shown
 */

/** @param {StillOrders} orders */
export function makeStillShown(orders) {
  const [pictures, about] = [h("div", { class: "still-pictures" }), h("div", { class: "stack" })];
  const showPictures = changing(pictures, (/** @type {StillDocument | null} */ still) =>
    still ? picturesOf(still) : [],
  );
  const showAbout = changing(about, (/** @type {Shown} */ shown) => (shown ? aboutOf(shown, orders) : [nothingYet()]));
  const element = h("div", { class: "still-shown" }, pictures, about);
  return {
    element,
    show: (/** @type {StillDocument[] | null} */ held) => {
      const still = held?.[0] ?? null;
      element.dataset["still"] = still?.id ?? "";
      showPictures(still);
      showAbout(still && { still, waiting: (held?.length ?? 1) - 1 });
    },
  };
}

function nothingYet() {
  return h("p", {
    class: "lead",
    text: "What is taken shows up here before it is kept. The mirrors stay where they stand.",
  });
}

/**
 * Show the picture of each camera; a click opens it at full size.
 * @param {StillDocument} still
 */
export function picturesOf(still) {
  return still.cameras.map((camera) => {
    const words = cameraWords(camera);
    const caption = h("figcaption", {}, h("b", { text: CAMERAS[camera.camera] }), " ", h("span", { text: words }));
    if (camera.came === 0)
      return h(
        "figure",
        { class: `still-picture of-${camera.camera}` },
        h("p", { class: "blank", text: "Nothing came." }),
        caption,
      );
    const drawn = makeDrawn({ width: 1440, height: 1080 });
    drawn.show(`${still.url}/cameras/${camera.camera}.jpg`, `${CAMERAS[camera.camera]}, ${words}`);
    const open = h(
      "a",
      {
        href: `${still.url}/cameras/${camera.camera}.jpg`,
        target: "_blank",
        rel: "noopener",
        title: "Open it at full size",
      },
      drawn.element,
    );
    return h("figure", { class: `still-picture of-${camera.camera}` }, open, caption);
  });
}

/**
 * @param {NonNullable<Shown>} shown
 * @param {StillOrders} orders
 */
function aboutOf({ still, waiting }, orders) {
  const name = textField("Keep it as", { value: still.name });
  const keep = () => orders.keep(still.id, name.value().trim() === still.name ? "" : name.value().trim());
  const missing = missingWords(still);
  return [
    missing.length > 0 &&
      h(
        "div",
        { class: "strip warn", role: "status" },
        icon("warn"),
        h(
          "ul",
          {},
          missing.map((text) => h("li", { text })),
        ),
      ),
    ...still.warnings.map((text) => h("p", { class: "strip warn" }, icon("info"), text)),
    name.element,
    h(
      "p",
      { class: "actions" },
      h(
        "button",
        { type: "button", class: "plain primary", data: { keep: "keep" }, on: { click: () => void keep() } },
        icon("check"),
        "Keep",
      ),
      h(
        "button",
        {
          type: "button",
          class: "plain",
          data: { keep: "discard" },
          on: { click: () => void orders.trash.remove(still, "is discarded") },
        },
        icon("trash"),
        "Discard",
      ),
      waiting > 0 &&
        h("span", {
          class: "why",
          text: `${count(waiting)} more ${waiting === 1 ? "waits" : "wait"} to be kept or discarded.`,
        }),
    ),
  ];
}
