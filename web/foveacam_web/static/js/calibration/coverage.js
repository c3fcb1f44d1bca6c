// Where in the picture the board has been, and how it was tilted.

import { h, s } from "../dom.js";
import { number } from "../format.js";

/** @typedef {import("./documents.js").WideSample} WideSample */

const TILTS_DEG = [0, 10, 20, 30];
const COLUMNS = 6;
const ROWS = 4;

/**
 * The picture as a map: a dot for each view, the cells that have one filled.
 * @param {WideSample[]} samples
 * @param {{width: number, height: number}} size of the picture, px
 */
export function drawCoverage(samples, { width, height }) {
  const cell = { width: width / COLUMNS, height: height / ROWS };
  const held = new Set(samples.map(({ centre_px: [x, y] }) => `${Math.floor(x / cell.width)} ${Math.floor(y / cell.height)}`));
  const cells = Array.from({ length: COLUMNS * ROWS }, (_, index) => [index % COLUMNS, Math.floor(index / COLUMNS)]).map(([x = 0, y = 0]) =>
    s("rect", { class: held.has(`${x} ${y}`) ? "cell held" : "cell", x: x * cell.width, y: y * cell.height, width: cell.width, height: cell.height }));
  const words = samples.length === 0 ? "No view yet." : `${samples.length} views; their middles lie in ${held.size} of ${COLUMNS * ROWS} parts of the picture.`;
  return s("svg", { class: "coverage", viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": `Coverage of the picture. ${words}` }, cells,
    samples.map(({ centre_px: [x, y], rms_px, tilt_deg }) => s("circle", { cx: x, cy: y, r: height / 54 },
      s("title", { text: `${tilt_deg === null ? "" : `tilt ${number(tilt_deg, 0)}°, `}${number(rms_px, 3)} px` }))),
    samples.length === 0 ? s("text", { x: width / 2, y: height / 2, "text-anchor": "middle", text: "No view yet" }) : null);
}

/**
 * How many views there are of each tilt.
 * @param {WideSample[]} samples
 * @param {number | null} covered how much of what is wanted, as the server counts it
 */
export function drawTilts(samples, covered) {
  const counts = TILTS_DEG.map((from, index) => samples.filter(({ tilt_deg }) =>
    tilt_deg !== null && Math.abs(tilt_deg) >= from && Math.abs(tilt_deg) < (TILTS_DEG[index + 1] ?? Infinity)).length);
  const most = Math.max(1, ...counts);
  const rows = counts.flatMap((count, index) => {
    const until = TILTS_DEG[index + 1];
    const part = h("span", { class: "part" });
    part.style.inlineSize = `${(count / most) * 100}%`;
    return [h("dt", { text: until === undefined ? `over ${TILTS_DEG[index]}°` : `${TILTS_DEG[index]}–${until}°` }),
      h("dd", {}, h("span", { class: "bar", "aria-hidden": "true" }, part), h("span", { class: "number", text: String(count) }))];
  });
  const title = covered === null ? "Tilt of the board" : `Tilt of the board: ${covered <= 1 && !Number.isInteger(covered) ? `${number(covered * 100, 0)} %` : covered} covered`;
  return h("div", { class: "tilts" }, h("h4", { text: title }), h("dl", {}, rows));
}
