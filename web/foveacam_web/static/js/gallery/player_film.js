// Options of a film of the recording, which the server makes and the browser downloads.

import { bar } from "../parts.js";
import { fill, h, html } from "../dom.js";
import { count } from "../format.js";
import { icon } from "../icons.js";

/**
 * @import { RecordingDocument } from "#api"
 * @import { FilmShow } from "#page"
 */

/** @type {readonly [FilmShow, string][]} */
const SHOWS = Object.freeze([
  ["wide", "Wide view"],
  ["left", "Left fovea"],
  ["right", "Right fovea"],
  ["side-by-side", "Both foveae, side by side"],
  ["anaglyph", "Both foveae, as an anaglyph"],
]);

/**
 * @param {RecordingDocument} recording
 * @param {{orders: import("./recordings.js").RecordingOrders, signal: AbortSignal}} context
 */
export function makeFilm(recording, { orders, signal }) {
  const has = (/** @type {string} */ role) =>
    recording.streams.some((stream) => stream.role === role && stream.frames > 0);
  const shows = SHOWS.filter(([show]) =>
    show === "side-by-side" || show === "anaglyph" ? has("left") && has("right") : has(show),
  );
  const choice = h(
    "select",
    { id: "film-show" },
    shows.map(([value, text]) => html`<option value=${value}>${text}</option>`),
  );
  const button = h("button", { type: "button", class: "plain" }, icon("down"), "Make an MP4");
  const far = h("div", { class: "stack", role: "status" });
  button.addEventListener("click", async () => {
    button.disabled = true;
    const told = (/** @type {number} */ done, /** @type {number} */ total) =>
      fill(
        far,
        bar("Film", { share: total > 0 ? done / total : null, text: `${count(done)} of ${count(total)} frames` }),
        html`<p class="why">${total > 0 ? `${count(done)} of ${count(total)} frames` : "Beginning …"}</p>`,
      );
    told(0, 0);
    const url = await orders.film(recording.id, /** @type {FilmShow} */ (choice.value), { told, signal });
    button.disabled = false;
    fill(far, url !== null && filmLink(url));
    if (url !== null && !signal.aborted) far.querySelector("a")?.click();
  });
  return html`<div class="stack">
    <div class="field"><label for="film-show">Shows</label>${choice}</div>
    <div class="actions">${button}</div>
    ${far}
  </div>`;
}

/** @param {string} url */
function filmLink(url) {
  return html`<a href=${url} download="">The film is made: download it</a>`;
}
