// Shows the last still that is neither kept nor discarded: its pictures, missing frames, keep and discard buttons.

import { changing, h, html } from "../../elements/dom.js";
import { count } from "../../elements/format.js";
import { icon } from "../../elements/icons.js";
import "../gallery/drawn.js";
import { cameraWords, CAMERAS, missingWords } from "./still_words.js";
import { textButton } from "../../elements/parts.js";
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
  return html`<p class="lead">What is taken shows up here before it is kept. The mirrors stay where they stand.</p>`;
}

/** Show the picture of each camera; a click opens it at full size. @param {StillDocument} still */
export function picturesOf(still) {
  return still.cameras.map((shown) => {
    const { camera, came } = shown;
    const words = cameraWords(shown);
    const url = `${still.url}/cameras/${camera}.jpg`;
    const alt = `${CAMERAS[camera]}, ${words}`;
    const picture = html`<a href=${url} target="_blank" rel="noopener" title="Open it at full size">
      <drawn-picture src=${url} text=${alt} width="1440" height="1080"></drawn-picture>
    </a>`;
    return html`<figure class="still-picture of-${camera}">
      ${came > 0 ? picture : html`<p class="blank">Nothing came.</p>`}
      <figcaption><b>${CAMERAS[camera]}</b> <span>${words}</span></figcaption>
    </figure>`;
  });
}

/** @param {NonNullable<Shown>} shown @param {StillOrders} orders */
function aboutOf({ still, waiting }, orders) {
  const name = textField("Keep it as", { value: still.name });
  const keep = () => orders.keep(still.id, name.value().trim() === still.name ? "" : name.value().trim());
  const missing = missingWords(still);
  return [
    missing.length > 0 &&
      html`<div class="strip warn" role="status">
        ${icon("warn")}
        <ul>${missing.map((text) => html`<li>${text}</li>`)}</ul>
      </div>`,
    ...still.warnings.map((text) => html`<p class="strip warn">${icon("info")}${text}</p>`),
    name.element,
    html`<p class="actions">
      ${textButton("Keep", () => keep(), { kind: "plain primary", picture: "check" })}
      ${textButton("Discard", () => orders.remove(still, "is discarded"), { picture: "trash" })}
      ${
        waiting > 0 &&
        html`<span class="why">
          ${count(waiting)} more ${waiting === 1 ? "waits" : "wait"} to be kept or discarded.
        </span>`
      }
    </p>`,
  ];
}
