// Plots the residual of each step of the vergence loop on a logarithmic scale, which shows whether it converged.

import { html, update } from "../elements/dom.js";
import { angle, millis, number } from "../elements/format.js";
import "../elements/plot.js";

/**
 * @import { StepDocument } from "#api"
 * @import { Curve, PlotSpec } from "../elements/plot.js"
 */

const FLOOR_PX = 0.01;
const GOAL_PX = 0.5;
const FEWEST_STEPS = 6;

/** Show the steps. @param {HTMLElement} place @param {StepDocument[]} steps */
export function showSteps(place, steps) {
  if (steps.length === 0) {
    const text = "The residual between the eyes, step by step, appears here during a fixation.";
    return update(place, html`<p class="empty">${text}</p>`);
  }
  const unmatched = steps.every((step) => step.residual_x_px === null);
  update(
    place,
    html`<value-plot .spec=${specOf(steps)}></value-plot>
      ${unmatched && html`<p class="empty">No step found a match</p>`} ${table(steps)}`,
  );
}

/** @param {StepDocument[]} steps @returns {PlotSpec} */
function specOf(steps) {
  const px = steps.flatMap((step) => [step.residual_x_px, step.residual_y_px].map((each) => Math.abs(each ?? 0)));
  const last = Math.max(FEWEST_STEPS, ...steps.map(({ index }) => index + 1));
  const goal = [1, last].map((x) => ({ x, y: GOAL_PX, sigma: 0 }));
  return {
    words: inWords(steps),
    x: {
      name: "step",
      from: 0.8,
      to: last + 0.2,
      whole: true,
      text: (at) => `${at}, ${steps.find(({ index }) => index + 1 === at)?.phase ?? ""}`,
    },
    y: {
      name: "left − right, px",
      log: true,
      span: { from: FLOOR_PX, to: 10 ** Math.ceil(Math.log10(Math.max(10, ...px))) },
    },
    curves: [
      { name: "goal 0.5 px", colour: "--good", dash: [4, 3], mark: true, runs: [goal] },
      curveOf("across", "--text-faint", steps, (step) => step.residual_y_px),
      curveOf("along", "--accent", steps, (step) => step.residual_x_px),
    ],
  };
}

/**
 * @param {string} name @param {string} colour @param {StepDocument[]} steps
 * @param {(step: StepDocument) => number | null} of
 * @returns {Curve}
 */
function curveOf(name, colour, steps, of) {
  const run = steps.flatMap((step) => {
    const px = of(step);
    return px === null ? [] : [{ x: step.index + 1, y: Math.max(FLOOR_PX, Math.abs(px)), sigma: 0 }];
  });
  return { name, colour, dot_px: 6, runs: run.length > 0 ? [run] : [] };
}

/** @param {StepDocument[]} steps */
function table(steps) {
  const head = ["", "Phase", "Left ax, ay", "Right ax, ay", "Δx px", "Δy px", "Score", "Compute"];
  const rows = steps.map(
    (step) =>
      html`<tr>
      ${[
        step.index + 1,
        step.phase,
        `${angle(step.left_ax_deg, 3)} ${angle(step.left_ay_deg, 3)}`,
        `${angle(step.right_ax_deg, 3)} ${angle(step.right_ay_deg, 3)}`,
        number(step.residual_x_px, 2),
        number(step.residual_y_px, 2),
        number(step.score, 3),
        millis(step.compute_ms),
      ].map((text) => html`<td>${String(text)}</td>`)}
    </tr>`,
  );
  return html`<details class="steps">
    <summary>${steps.length} ${steps.length === 1 ? "step" : "steps"} in numbers</summary>
    <div class="scroll-x" tabindex="0" role="region" aria-label="Steps in numbers">
      <table>
        <thead><tr>${head.map((text) => html`<th scope="col">${text}</th>`)}</tr></thead>
        <tbody>${rows}</tbody>
      </table>
    </div>
  </details>`;
}

/** @param {StepDocument[]} steps */
function inWords(steps) {
  const last = steps.at(-1);
  const end =
    last?.residual_x_px === null || last === undefined ? "not matched" : `${number(last.residual_x_px, 2)} px`;
  return `Residual per step: ${steps.length} steps, the last one ${end}.`;
}
