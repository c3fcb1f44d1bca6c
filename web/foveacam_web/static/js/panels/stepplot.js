// Plots the residual of each step of the vergence loop on a logarithmic scale, which shows whether it converged.

import { fill, html, svg } from "../elements/dom.js";
import { angle, millis, number } from "../elements/format.js";

/** @import { StepDocument } from "#api" */

const WIDTH = 340;
const HEIGHT = 128;
const PAD = { left: 34, right: 8, top: 8, bottom: 20 };
const FLOOR_PX = 0.01;
const GOAL_PX = 0.5;
const FEWEST_STEPS = 6;

/** Draw the steps. @param {HTMLElement} place @param {StepDocument[]} steps */
export function drawSteps(place, steps) {
  if (steps.length === 0) {
    fill(
      place,
      html`<p class="empty">The residual between the eyes, step by step, appears here during a fixation.</p>`,
    );
    return;
  }
  const top = Math.max(
    10,
    ...steps.flatMap((step) => [step.residual_x_px, step.residual_y_px].map((px) => Math.abs(px ?? 0))),
  );
  const decades = { low: Math.log10(FLOOR_PX), high: Math.ceil(Math.log10(top)) };
  const last = Math.max(FEWEST_STEPS - 1, ...steps.map(({ index }) => index));
  const x = (/** @type {number} */ index) => PAD.left + (index / last) * (WIDTH - PAD.left - PAD.right);
  const y = (/** @type {number} */ px) => {
    const part = (Math.log10(Math.max(FLOOR_PX, Math.abs(px))) - decades.low) / (decades.high - decades.low);
    return HEIGHT - PAD.bottom - part * (HEIGHT - PAD.top - PAD.bottom);
  };
  fill(
    place,
    html`<svg class="stepplot" viewBox="0 0 ${WIDTH} ${HEIGHT}" role="img" aria-label=${inWords(steps)}>
      ${grid(decades, y)}
      <line class="goal" x1=${PAD.left} x2=${WIDTH - PAD.right} y1=${y(GOAL_PX)} y2=${y(GOAL_PX)}></line>
      <text class="goal-name" x=${WIDTH - PAD.right} y=${y(GOAL_PX) - 3} text-anchor="end">0.5 px</text>
      ${ticks(steps, x, last)}
      ${
        steps.every((step) => step.residual_x_px === null)
          ? svg`<text class="nothing" x=${WIDTH / 2} y=${HEIGHT / 2 + 16} text-anchor="middle">
          No step found a match
        </text>`
          : null
      }
      ${series(steps, "vertical", (step) => step.residual_y_px, x, y)}
      ${series(steps, "along", (step) => step.residual_x_px, x, y)}
    </svg>`,
    legend(),
    table(steps),
  );
}

/** @param {{low: number, high: number}} decades @param {(px: number) => number} y */
function grid({ low, high }, y) {
  const exponents = Array.from({ length: high - low + 1 }, (_, step) => low + step);
  return exponents.flatMap((exponent) => {
    const at = y(10 ** exponent);
    const name = exponent < 0 ? (10 ** exponent).toFixed(-exponent) : String(10 ** exponent);
    return [
      svg`<line class="grid" x1=${PAD.left} x2=${WIDTH - PAD.right} y1=${at} y2=${at}></line>`,
      svg`<text class="tick" x=${PAD.left - 5} y=${at + 3} text-anchor="end">${name}</text>`,
    ];
  });
}

/** @param {StepDocument[]} steps @param {(index: number) => number} x @param {number} last */
function ticks(steps, x, last) {
  const every = Math.ceil((last + 1) / 12);
  return steps
    .filter(({ index }) => index % every === 0)
    .map(
      ({ index, phase }) =>
        svg`<text class="tick" x=${x(index)} y=${HEIGHT - 6} text-anchor="middle">
        ${index + 1}
        <title>${phase}</title>
      </text>`,
    );
}

/**
 * @param {StepDocument[]} steps
 * @param {string} kind
 * @param {(step: StepDocument) => number | null} of
 * @param {(index: number) => number} x
 * @param {(px: number) => number} y
 */
function series(steps, kind, of, x, y) {
  const known = steps.flatMap((step) => {
    const px = of(step);
    return px === null ? [] : [{ step, px }];
  });
  const line = known.map(({ step, px }) => `${x(step.index)} ${y(px)}`).join("L");
  return [
    known.length > 1 ? svg`<path class="line ${kind}" d="M${line}"></path>` : null,
    ...known.map(
      ({ step, px }) =>
        svg`<circle class="dot ${kind}" cx=${x(step.index)} cy=${y(px)} r="2.6">
        <title>step ${step.index + 1}, ${step.phase}: ${number(px, 3)} px</title>
      </circle>`,
    ),
  ];
}

function legend() {
  return html`<p class="legend">
    <span class="key along" title="along the epipolar line">along</span>
    <span class="key vertical" title="across the epipolar line">across</span>
    <span class="unit">|left − right|, fovea px</span>
  </p>`;
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
