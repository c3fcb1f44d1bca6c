// Tuning of the loop: its buttons, its progress, and what the last tuning found.

import { html } from "../../elements/dom.js";
import { clockTime, number } from "../../elements/format.js";
import { jobRow, textButton } from "../../elements/parts.js";
import { hasEnded } from "../../transport/jobs.js";
import { tuningRows, tuningWords, whyNotTuned } from "./words.js";
import { API } from "../../root.js";

/**
 * @import { LoopTuneDocument } from "#api"
 * @import { ConsoleState } from "#page"
 * @import { LoopOrders } from "./orders.js"
 */

const SVG_URL = `${API}/loop/tune.svg`;
const CAPTION = "Step response of each loop, before and after";
const HEADS = ["Axis", "Settled before", "after", "Overshoot before", "after", "Ultimate gain", "Period"];

/** @param {ConsoleState} state @param {LoopOrders} orders */
export function tuningParts({ loop, loop_tuning, tune_refusal }, orders) {
  const words = loop_tuning && tuningWords(loop_tuning);
  const running = loop_tuning !== null && !hasEnded(loop_tuning.state);
  const why = running ? "It is being tuned." : whyNotTuned(loop);
  const button = (/** @type {string} */ text, /** @type {boolean} */ polish, /** @type {string} */ title) =>
    textButton(text, () => orders.tune(polish), { title, disabled: why !== null });
  return html`<p class="lead">
      Finds the gains on the present target. Relay feedback makes each axis oscillate a little and measures its response,
      which takes about a minute; polishing then tries 48 candidates by CMA-ES, which takes some minutes. Aborting leaves
      the gains unchanged.
    </p>
    <div class="actions">
      ${button("Tune", false, "By relays alone, about a minute")}
      ${button("Tune and polish", true, "By relays, then by CMA-ES: some minutes")}
      ${textButton("Back to default gains", () => orders.resetGains(), {
        title: "Default gains of pan, depth and vertical shift",
        disabled: running,
      })}
      <span class="why">${why ?? ""}</span>
    </div>
    ${tune_refusal && html`<p class="refused" role="alert">${tune_refusal}</p>`}
    ${
      running &&
      jobRow(loop_tuning, {
        label: "Tuning the loop",
        words: `Tuning: ${words}`,
        cancel: () => orders.abortTuning(),
        verb: "Abort",
      })
    }
    ${words && !running && html`<p class="refused" role="status">${words}</p>`}
    ${loop?.tuned && resultOf(loop.tuned)}`;
}

/** @param {LoopTuneDocument} tuned */
function resultOf(tuned) {
  const { tuned_utc, cost_before, cost, candidates, picture_url } = tuned;
  const how = candidates > 0 ? `relays and ${candidates} candidates` : "relays";
  const words = `Tuned at ${clockTime(tuned_utc)} by ${how}: the step-response cost fell from ${number(cost_before, 2)} to ${number(cost, 2)}.`;
  return html`<p class="lead">${words}</p>
    <div class="scroll-x">
      <table class="compare tuned">
        <thead><tr>${HEADS.map((head) => html`<th scope="col">${head}</th>`)}</tr></thead>
        <tbody>
          ${tuningRows(tuned).map(
            ([axis, ...values]) =>
              html`<tr><th scope="row">${axis}</th>${values.map((value) => html`<td>${value}</td>`)}</tr>`,
          )}
        </tbody>
      </table>
    </div>
    <figure class="diagram">
      <a href=${SVG_URL} target="_blank" rel="noopener" title="Open it as SVG">
        <img src=${`${picture_url}?at=${encodeURIComponent(tuned_utc)}`} alt=${CAPTION} loading="lazy" />
      </a>
      <figcaption>${CAPTION}</figcaption>
    </figure>
    <p><a href=${SVG_URL} target="_blank" rel="noopener">The picture as SVG</a></p>`;
}
