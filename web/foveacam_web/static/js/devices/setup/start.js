// Shows the start of the rig step by step: as a strip while it opens or stays at what failed, and as a list.

import { SETUP_ADDRESS } from "../../addresses.js";
import { html, update } from "../../elements/dom.js";
import { sentence } from "../../elements/format.js";
import { startStands, STATES, stepName, stepProgress } from "./words.js";
import { toolButton } from "../../elements/parts.js";

/**
 * @import { StartDocument, StartStepDocument } from "#api"
 * @import { Store } from "#console"
 */

/** Show the strip of the start. @param {HTMLElement} strip @param {Store} store */
export function mountStart(strip, store) {
  store.on(["start", "start_dismissed", "setup_page"], ({ start, start_dismissed, setup_page }) => {
    strip.hidden = !startStands(start) || start_dismissed || setup_page;
    update(strip, strip.hidden || !start ? [] : stripOf(start, () => store.set({ start_dismissed: true })));
  });
}

/** @param {StartDocument} start @param {() => void} dismiss */
function stripOf({ steps }, dismiss) {
  const failed = steps.some(({ state }) => state === "failed");
  return html`<span class="start-title">${failed ? "The start met problems" : "The rig opens"}</span>
    <ol class="start-line">${steps.map(
      (step) => html`<li class=${STATES[step.state].tone} title=${sentence(step.detail) || STATES[step.state].word}>
        <span aria-hidden="true">${STATES[step.state].mark}</span> ${stepName(step)}<span class="unseen"
          >: ${STATES[step.state].word}</span
        >${stepProgress(step) && html`<span class="start-progress">${stepProgress(step)}</span>`}
      </li>`,
    )}</ol>
    <a class="plain" href=${SETUP_ADDRESS}>Set up</a>
    ${toolButton("Dismiss", "close", dismiss)}`;
}

/** List the steps with what failed and what to do. @param {StartDocument | null} start */
export function startList(start) {
  return html`<ol class="start-steps">${(start?.steps ?? []).map(stepRow)}</ol>`;
}

/** @param {StartStepDocument} step */
function stepRow(step) {
  const { mark, tone, word } = STATES[step.state];
  return html`<li class=${tone} data-step=${step.device}>
    <span class="mark" aria-hidden="true">${mark}</span>
    <span><b>${stepName(step)}</b> <span class="word">${word}</span></span>
    ${step.detail && html`<span class="note ${tone}">${sentence(stepProgress(step) || step.detail)}</span>`}
    ${step.remedy && !step.detail.includes(step.remedy) && html`<span class="note">${sentence(step.remedy)}</span>`}
  </li>`;
}
