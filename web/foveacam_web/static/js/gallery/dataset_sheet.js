// The contact sheet: a button for every point at its position in the grid, which shows the point large.

import { fresh } from "../calibration/pictures.js";
import { changing, h } from "../dom.js";
import { sentence } from "../format.js";
import { pointWords } from "./dataset_words.js";
import { makeDrawn } from "./drawn.js";
import { makePointView } from "./point_view.js";

/** @import { CaptureDocument, PointDocument, PointsDocument } from "#api" */

/** @type {Readonly<Record<string, [number, number]>>} rows and columns that a key moves */
const WAYS = Object.freeze({ ArrowLeft: [0, -1], ArrowRight: [0, 1], ArrowUp: [-1, 0], ArrowDown: [1, 0] });

/** @param {AbortSignal} signal */
export function makeSheet(signal) {
  const drawn = makeDrawn();
  const cells = h("div", { class: "cells" });
  const skipped = h("div", {});
  const frame = h("div", { class: "contact" }, drawn.element, cells);
  const view = makePointView((index) => choose(index));
  signal.addEventListener("abort", () => view.dialog.remove());
  /** @type {{dataset: CaptureDocument, points: PointsDocument} | null} */
  let now = null;
  const choose = (/** @type {number} */ index) => {
    const cell = cells.querySelector(`[data-keep="${index}"]`);
    if (!(cell instanceof HTMLElement)) return;
    for (const each of cells.querySelectorAll('[tabindex="0"]')) each.setAttribute("tabindex", "-1");
    cell.tabIndex = 0;
    cell.focus();
  };
  const open = (/** @type {number} */ index) => {
    if (!now) return;
    const { dataset, points } = now;
    view.open(
      {
        url: dataset.url,
        stamp: dataset.created_utc ?? "",
        points: points.points,
        planned: dataset.points.planned,
        scans: dataset.points.scans,
      },
      index,
    );
  };
  cells.addEventListener("keydown", (event) => {
    const way = WAYS[event.key];
    const from = now?.points.points.find(({ index }) => String(index) === indexOf(event.target));
    if (!way || !from) return;
    event.preventDefault();
    const to = now?.points.points.find(
      (point) => point.sheet_row === from.sheet_row + way[0] && point.sheet_column === from.sheet_column + way[1],
    );
    if (to) choose(to.index);
  });
  cells.addEventListener("click", (event) => {
    const index = indexOf(event.target);
    if (index !== undefined) open(Number(index));
  });
  const showCells = changing(cells, cellsOf);
  const showSkipped = changing(skipped, skippedOf);
  return {
    element: h("div", { class: "stack" }, h("div", { class: "scroll-x" }, frame), skipped),
    show: (/** @type {CaptureDocument} */ dataset, /** @type {PointsDocument} */ points) => {
      now = { dataset, points };
      frame.style.setProperty("--columns", String(points.columns));
      frame.style.setProperty("--rows", String(points.rows));
      drawn.show(
        fresh(`${dataset.url}/sheet.jpg`, String(points.points.length)),
        "Contact sheet: what the left fovea saw at every point",
      );
      showCells({ points: points.points, scans: dataset.points.scans });
      showSkipped(points.skipped);
    },
  };
}

/** @param {EventTarget | null} target */
function indexOf(target) {
  return target instanceof HTMLElement ? target.dataset["keep"] : undefined;
}

/** @param {{points: PointDocument[], scans: number}} now */
function cellsOf({ points, scans }) {
  return points.map((point, number) => {
    const cell = h("button", {
      type: "button",
      tabindex: number === 0 ? 0 : -1,
      data: { keep: String(point.index) },
      "aria-label": [`Point ${point.index + 1}`, pointWords(point, scans)].filter(Boolean).join(": "),
      title: pointWords(point, scans),
    });
    cell.style.gridArea = `${point.sheet_row + 1} / ${point.sheet_column + 1}`;
    return cell;
  });
}

/** @param {PointsDocument["skipped"]} skipped */
function skippedOf(skipped) {
  if (skipped.length === 0) return [];
  return [
    h(
      "details",
      {},
      h("summary", { text: `Passed over: ${skipped.length}` }),
      h(
        "ul",
        { class: "sentences" },
        skipped.map(({ index, why }) => h("li", { text: `Point ${index + 1}: ${sentence(why)}` })),
      ),
    ),
  ];
}
