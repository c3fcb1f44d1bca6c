// The result in one line below the wide view of a narrow page, which has no room for the card beside it.

import { answerOf, answerText, basisOf, basisWords, estimateText, heading } from "../looking/answers.js";
import { html, update } from "../elements/dom.js";
import { MISSING } from "../elements/format.js";

/** @import { CurrentFixation, Store } from "#console" */

/** Fill the strip, a link to the card. @param {HTMLElement} place @param {Store} store */
export function mountResultStrip(place, store) {
  place.addEventListener("click", (event) => {
    event.preventDefault(); // the address names pages
    document.getElementById("fixation")?.scrollIntoView({ behavior: "smooth", block: "center" });
  });
  store.on(["current"], ({ current }) => {
    place.hidden = current === null;
    if (current) update(place, content(current));
  });
}

/** @param {CurrentFixation} current */
function content({ state, fixation, estimate, problem }) {
  if (fixation)
    return html`<strong class="number">${answerText(answerOf(fixation))}</strong>
      <span>${basisWords(basisOf(fixation), fixation) || heading(fixation).title}</span>`;
  if (state === "failed" || state === "cancelled")
    return html`<strong>${state === "failed" ? (problem?.title ?? "Failed") : "Cancelled"}</strong>`;
  return html`<span class="spinner" aria-hidden="true"></span>
    <strong class="number">${estimateText(estimate) || MISSING}</strong><span>looking</span>`;
}
