// Shows where in the picture the board was seen, and at which tilts.

import { html, svg } from "../../../elements/dom.js";
import { number, pixels } from "../../../elements/format.js";

/** @import { WideSampleDocument } from "#api" */

const TILTS_DEG = [0, 10, 20, 30];
const WAYS = 5; // frontal, and tilted towards each of the four sides
const COLUMNS = 12;
const ROWS = 9;

/**
 * Draw the picture as a map: a dot for each view, covered cells filled.
 * @param {WideSampleDocument[]} samples
 * @param {{width: number, height: number, cells: number[][] | null}} picture its size in px, and how often each cell was covered
 */
export function drawCoverage(samples, { width, height, cells: counts }) {
  const cell = { width: width / COLUMNS, height: height / ROWS };
  const held = coveredOf(counts ?? []);
  const cells = Array.from({ length: COLUMNS * ROWS }, (_, index) => [
    index % COLUMNS,
    Math.floor(index / COLUMNS),
  ]).map(
    ([x = 0, y = 0]) =>
      svg`<rect
      class=${held.has(`${x} ${y}`) ? "cell held" : "cell"} x=${x * cell.width} y=${y * cell.height}
      width=${cell.width} height=${cell.height}
    ></rect>`,
  );
  const words =
    samples.length === 0
      ? "No view yet."
      : `${samples.length} ${samples.length === 1 ? "view" : "views"}${counts ? ` in ${held.size} of ${COLUMNS * ROWS} parts of the picture` : ""}.`;
  return html`<svg class="coverage" viewBox="0 0 ${width} ${height}" role="img" aria-label="Coverage of the picture. ${words}">
    ${cells}
    ${samples.map(
      ({ centre_px: [x, y], rms_px, tilt_deg }) =>
        svg`<circle cx=${x} cy=${y} r=${height / 54}>
        <title>${`${tilt_deg === null ? "" : `tilt ${number(tilt_deg, 0)}°, `}${pixels(rms_px)}`}</title>
      </circle>`,
    )}
    ${samples.length === 0 ? svg`<text x=${width / 2} y=${height / 2} text-anchor="middle">No view yet</text>` : null}
  </svg>`;
}

/** @param {number[][]} counts */
function coveredOf(counts) {
  return new Set(counts.flatMap((row, y) => row.flatMap((count, x) => (count > 0 ? [`${x} ${y}`] : []))));
}

/**
 * Show the number of views at each tilt.
 * @param {WideSampleDocument[]} samples
 * @param {number | null} covered number of tilts that were covered
 */
export function drawTilts(samples, covered) {
  const counts = TILTS_DEG.map(
    (from, index) =>
      samples.filter(
        ({ tilt_deg }) =>
          tilt_deg !== null && Math.abs(tilt_deg) >= from && Math.abs(tilt_deg) < (TILTS_DEG[index + 1] ?? Infinity),
      ).length,
  );
  const most = Math.max(1, ...counts);
  const rows = counts.flatMap((count, index) => {
    const until = TILTS_DEG[index + 1];
    return [
      html`<dt>${until === undefined ? `over ${TILTS_DEG[index]}°` : `${TILTS_DEG[index]}–${until}°`}</dt>`,
      html`<dd>
        <span class="bar" aria-hidden="true"><span class="part" .style=${`inline-size: ${(count / most) * 100}%`}></span></span>
        <span class="number">${String(count)}</span>
      </dd>`,
    ];
  });
  const title =
    covered === null
      ? "Tilt of the board"
      : `Tilt of the board: ${covered} of ${WAYS} shown (head on, each side nearer)`;
  return html`<div class="tilts"><h4>${title}</h4><dl>${rows}</dl></div>`;
}
