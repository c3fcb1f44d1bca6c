// Options of a film of the recording, which the server makes and the browser downloads.

import { bar } from "../calibration/parts.js";
import { fill, h } from "../dom.js";
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
 * @param {{orders: import("./recording_orders.js").RecordingOrders, signal: AbortSignal}} context
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
    shows.map(([value, text]) => h("option", { value, text })),
  );
  const button = h("button", { type: "button", class: "plain" }, icon("down"), "Make an MP4");
  const far = h("div", { class: "stack", role: "status" });
  button.addEventListener("click", async () => {
    button.disabled = true;
    const told = (/** @type {number} */ done, /** @type {number} */ total) =>
      fill(
        far,
        bar("Film", { share: total > 0 ? done / total : null, text: `${count(done)} of ${count(total)} frames` }),
        h("p", { class: "why", text: total > 0 ? `${count(done)} of ${count(total)} frames` : "Beginning …" }),
      );
    told(0, 0);
    const url = await orders.film(recording.id, /** @type {FilmShow} */ (choice.value), { told, signal });
    button.disabled = false;
    fill(far, url !== null && filmLink(url));
    if (url !== null && !signal.aborted) far.querySelector("a")?.click();
  });
  return h(
    "div",
    { class: "stack" },
    h("div", { class: "field" }, h("label", { for: "film-show", text: "Shows" }), choice),
    h("div", { class: "actions" }, button),
    far,
  );
}

/** @param {string} url */
function filmLink(url) {
  return h("a", { href: url, download: "", text: "The film is made: download it" });
}
