// Lists the captures that ended before their last point, newest first: their points, the reason, and the resume button.

import { nothing, textButton } from "../../elements/parts.js";
import { changing, html, repeat } from "../../elements/dom.js";
import { count, sentence } from "../../elements/format.js";
import { isCapturing } from "./state.js";
import { galleryAddress } from "../../addresses.js";
import { sizeText } from "./words.js";

/**
 * @import { CaptureDocument } from "#api"
 * @import { Store } from "#console"
 * @import { CaptureOrders } from "./orders.js"
 */

const MOST = 8;

/** @param {HTMLElement} place @param {{store: Store, orders: CaptureOrders}} context */
export function mountPartials(place, { store, orders }) {
  const show = changing(place, (/** @type {CaptureDocument[] | null} */ partials) => partialsOf(partials, orders));
  store.on(["captures", "capturing"], ({ captures, capturing }) => {
    const runs = isCapturing(capturing) ? capturing?.capture_id : null; // the list may be older than the resumed run
    show(captures?.filter(({ id, resumable }) => resumable && id !== runs) ?? null);
  });
}

/** @param {CaptureDocument[] | null} partials @param {CaptureOrders} orders */
function partialsOf(partials, orders) {
  if (partials === null) return [nothing("The captures have not been read yet.")];
  if (partials.length === 0)
    return [
      nothing("None. Captures that were cancelled or interrupted are listed here and resume at their next point."),
    ];
  return [
    html`<ul class="partials">${repeat(
      partials.slice(0, MOST),
      ({ id }) => id,
      (capture) => partial(capture, orders),
    )}</ul>`,
    partials.length > MOST &&
      html`<p><a href="#/gallery/datasets">${count(partials.length - MOST)} more in the gallery</a></p>`,
  ];
}

/** @param {CaptureDocument} capture @param {CaptureOrders} orders */
function partial(capture, orders) {
  const { id, name, label, points, size_bytes, why } = capture;
  const resume = async (/** @type {{currentTarget: HTMLButtonElement}} */ { currentTarget: button }) => {
    button.disabled = true;
    await orders.resume(capture);
    button.disabled = false;
  };
  return html`<li>
    <div class="what">
      <a class="name" href=${galleryAddress("datasets", id)}>${name}</a>
      ${label && html`<span class="lead">${label}</span>`}
      <span class="number">${count(points.taken)} of ${count(points.planned)} points, ${sizeText(size_bytes)}</span>
      ${why && html`<span class="lead">${sentence(why)}</span>`}
    </div>
    ${textButton("Resume", resume, { name: `Resume ${name}` })}
  </li>`;
}
