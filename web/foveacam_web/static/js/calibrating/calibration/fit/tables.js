// Tables of a fit: each model's error at left-out poses, ours and the paper's, and the effect of each addition.

import { html } from "../../../elements/dom.js";
import { MISSING, number, pixels } from "../../../elements/format.js";
import { facts, sentenceNames, sentences } from "../facts.js";
import { badge, figures, nothing } from "../../../elements/parts.js";

/**
 * @import { FitDocument } from "#api"
 * @import { VariantStep } from "#page"
 * @typedef {{name: string, order: number | null, eye: string, chosen: boolean, size: number, text: string}} Score `size`: of its error
 */

const EYES = /** @type {const} */ (["left", "right"]);

/** Build the table of the mirror models (volts to angle). @param {FitDocument | null} fit */
export function mirrorTable(fit) {
  if (!fit?.models.length)
    return [
      nothing(
        "Not fitted yet. The table will list each model with its error at poses left out of its fit: the smallest is chosen.",
      ),
    ];
  const scores = fit.models.map(({ loo_deg: [x, y], ...model }) => ({
    ...model,
    size: Math.hypot(x, y),
    text: `${number(x, 4)}° ${number(y, 4)}°`,
  }));
  return [table("Mirrors, volts to angle", scores, "eye: x, y")];
}

/** Build the table of the rectification models over the field. @param {FitDocument | null} fit */
export function fieldTable(fit) {
  if (!fit?.fields?.length) return [];
  const scores = fit.fields.map(({ loo_px, ...model }) => ({ ...model, size: loo_px, text: pixels(loo_px) }));
  return [table("Rectification", scores, "eye")];
}

/** @param {string} title @param {Score[]} scores @param {string} what title of the eyes' columns */
function table(title, scores, what) {
  const most = Math.max(...scores.map(({ size }) => size));
  const least = Math.min(...scores.map(({ size }) => size).filter((size) => size > 0));
  const kinds = [...new Set(scores.map(kindOf))];
  const rows = kinds.map((kind) => {
    const [first, ...more] = scores.filter((score) => kindOf(score) === kind);
    const both = first ? [first, ...more] : more;
    return html`<tr class=${both.some(({ chosen }) => chosen) ? "chosen" : ""}>
      <th scope="row">${first?.name}</th>
      ${EYES.map((eye) =>
        cell(
          both.find((score) => score.eye === eye),
          { least, most },
        ),
      )}
    </tr>`;
  });
  return html`<div class="scroll-x" tabindex="0" role="region" aria-label=${title}>
    <table class="compare">
      <thead>
        <tr><th scope="col">${title}</th>${EYES.map((eye) => html`<th scope="col">${eye} ${what}</th>`)}</tr>
      </thead>
      <tbody>${rows}</tbody>
    </table>
  </div>`;
}

/** @param {Score} score */
function kindOf({ name, order }) {
  return `${name} ${order}`;
}

/**
 * @param {Score | undefined} score
 * @param {{least: number, most: number}} errors the smallest and the largest of all; the bars are logarithmic, so that small errors differ visibly
 */
function cell(score, { least, most }) {
  if (!score) return html`<td>${MISSING}</td>`;
  const share = shareOf(score.size, { least, most });
  return html`<td class="score eye-${score.eye}">
    <span class="bar" aria-hidden="true"><span class="part" .style=${`inline-size: ${100 * share}%`}></span></span>
    <span>${score.text}</span>
    ${score.chosen && badge("good", "taken")}
  </td>`;
}

/** @param {number} size @param {{least: number, most: number}} errors */
function shareOf(size, { least, most }) {
  const share = Math.log(size / least) / Math.log(most / least);
  return Number.isFinite(share) ? 0.06 + 0.94 * Math.max(0, share) : 0.06;
}

/**
 * Compare the paper's plain model of the same data with ours, and list the effect of each addition.
 * @param {FitDocument | null} fit
 */
export function paperTable(fit) {
  if (!fit?.paper) return [];
  const { steps: variant_steps = [], ...paper } = fit.paper;
  const steps = /** @type {VariantStep[]} */ (variant_steps);
  const ours = fit.models
    .filter((model) => model.chosen)
    .map(({ eye, loo_deg: [x, y] }) => `${eye} ${number(x, 4)}°, ${number(y, 4)}°`)
    .join(", ");
  const rows = facts(paper, sentenceNames(paper)).map(
    ([name, value]) => /** @type {[string, string]} */ ([`Paper: ${name.toLowerCase()}`, value]),
  );
  const trip =
    fit.volts_roundtrip_max_lsb == null
      ? []
      : [
          /** @type {[string, string]} */ ([
            "Ours: volts to angle to volts",
            `${number(fit.volts_roundtrip_max_lsb, 2)} DAC steps`,
          ]),
        ];
  return [
    html`<h4>Beside the paper’s plain model</h4>`,
    ...sentences(paper).map((text) => html`<p class="lead">${text}</p>`),
    figures([...rows, ["Ours: error on poses left out", ours], ...trip]),
    steps.length ? variants(steps) : null,
  ];
}

/** @param {VariantStep[]} steps */
function variants(steps) {
  const what = html`<p class="legend">
    RMS at poses left out, in pixels of the fovea. “Ours, but …” takes one addition away: what is lost is what it
    brings.
  </p>`;
  return html`<div class="scroll-x" tabindex="0" role="region" aria-label="What each addition brings">
    <h4>What each addition brings</h4>
    ${what}
    <table class="compare">
      <thead>
        <tr>
          ${["Model", "Pointing", "Rectification", "Rows apart"].map((text) => html`<th scope="col">${text}</th>`)}
        </tr>
      </thead>
      <tbody>
        ${steps.map(
          (step) =>
            html`<tr>
            <th scope="row" class="long">${step.name}</th>
            ${[step.pointing_rms_px, step.rectification_rms_px, step.epipolar_rms_px].map(
              (px) => html`<td>${pixels(px)}</td>`,
            )}
          </tr>`,
        )}
      </tbody>
    </table>
  </div>`;
}
