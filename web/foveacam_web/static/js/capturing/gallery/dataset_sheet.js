// The contact sheet: a button for every point at its position in the grid, which shows the point large.

import { fresh } from "../../calibrating/calibration/pictures.js";
import { h, html, update } from "../../elements/dom.js";
import { sentence } from "../../elements/format.js";
import { pointWords } from "./dataset_words.js";
import { makePointView } from "./point_view.js";

/** @import { CaptureDocument, PointDocument, PointsDocument } from "#api" */

/** @type {Readonly<Record<string, [number, number]>>} rows and columns that a key moves */
const WAYS = Object.freeze({ ArrowLeft: [0, -1], ArrowRight: [0, 1], ArrowUp: [-1, 0], ArrowDown: [1, 0] });

/** Return a function that shows the sheet of a dataset. @param {AbortSignal} signal */
export function makeSheet(signal) {
  const frame = h("div", { class: "contact" });
  const view = makePointView((index) => choose(index));
  signal.addEventListener("abort", () => view.dialog.remove());
  const choose = (/** @type {number} */ index) => {
    const cell = frame.querySelector(`[data-index="${index}"]`);
    if (!(cell instanceof HTMLElement)) return;
    for (const each of frame.querySelectorAll('[tabindex="0"]')) each.setAttribute("tabindex", "-1");
    cell.tabIndex = 0;
    cell.focus();
  };
  return (/** @type {CaptureDocument} */ dataset, /** @type {PointsDocument} */ { points, rows, columns, skipped }) => {
    const { url, created_utc } = dataset;
    const { planned, scans } = dataset.points;
    const move = (/** @type {KeyboardEvent} */ event) => {
      const way = WAYS[event.key];
      const { index } = /** @type {HTMLElement} */ (event.target).dataset;
      const from = points.find((point) => String(point.index) === index);
      if (!way || !from) return;
      event.preventDefault();
      const to = points.find(
        (point) => point.sheet_row === from.sheet_row + way[0] && point.sheet_column === from.sheet_column + way[1],
      );
      if (to) choose(to.index);
    };
    const open = (/** @type {number} */ index) =>
      view.open({ url, stamp: created_utc ?? "", points, planned, scans }, index);
    frame.style.setProperty("--columns", String(columns));
    frame.style.setProperty("--rows", String(rows));
    update(
      frame,
      html`<drawn-picture
          src=${fresh(`${url}/sheet.jpg`, String(points.length))}
          text="Contact sheet: what the left fovea saw at every point"
        ></drawn-picture>
        <div class="cells" @keydown=${move}>
          ${points.map((point, number) => cellOf(point, { scans, first: number === 0, open }))}
        </div>`,
    );
    return html`<div class="stack"><div class="scroll-x">${frame}</div><div>${skippedOf(skipped)}</div></div>`;
  };
}

/** @param {PointDocument} point @param {{scans: number, first: boolean, open: (index: number) => void}} context */
function cellOf(point, { scans, first, open }) {
  const { index, sheet_row, sheet_column } = point;
  const words = pointWords(point, scans);
  return html`<button
    type="button" tabindex=${first ? 0 : -1} data-index=${index} title=${words}
    aria-label=${[`Point ${index + 1}`, words].filter(Boolean).join(": ")}
    style="grid-area: ${sheet_row + 1} / ${sheet_column + 1}" @click=${() => open(index)}
  ></button>`;
}

/** @param {PointsDocument["skipped"]} skipped */
function skippedOf(skipped) {
  if (skipped.length === 0) return null;
  return html`<details>
    <summary>Passed over: ${skipped.length}</summary>
    <ul class="sentences">${skipped.map(({ index, why }) => html`<li>Point ${index + 1}: ${sentence(why)}</li>`)}</ul>
  </details>`;
}
