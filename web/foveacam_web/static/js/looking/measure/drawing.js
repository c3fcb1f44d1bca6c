// Draws measurements over a view in CSS px: points, lines, outlines, and the value of the selected one.

import { svg } from "../../elements/dom.js";
import { valueText } from "./words.js";

/**
 * @import { MeasurementDocument } from "#api"
 * @import { MeasureDraft, MeasureKind, MeasuredView, Point } from "#page"
 * @import { Area, Size } from "../../video/labels.js"
 * @import { Viewport } from "../../video/viewport.js"
 */

const LABEL_HEIGHT_PX = 18;
const LETTER_PX = 8.8; // of bold tabular figures at the label's size

/**
 * @param {MeasurementDocument} measured
 * @param {MeasuredView} view
 * @param {Viewport} viewport
 * @param {{selected: boolean, box: Size}} how `box`: the view's size, CSS px
 */
export function drawMeasurement(measured, view, viewport, { selected, box }) {
  const places = (measured.drawn_px[view] ?? []).map(([x, y]) => viewport.toCss({ x, y }));
  const line = pathOf(places, measured.kind === "plane");
  return svg`<g class=${selected ? "measured selected" : "measured"} data-id=${measured.id}>
    ${places.length > 1 ? [svg`<path class="under" d=${line}></path>`, svg`<path class="line" d=${line}></path>`] : null}
    ${measured.kind === "plane" ? null : places.map(({ x, y }) => cross(x, y))}
    ${selected ? label(valueText(measured), places, box) : null}
  </g>`;
}

/** @param {MeasureDraft} draft @param {Viewport} viewport */
export function drawDraft({ kind, from, to }, viewport) {
  const a = viewport.toCss(from);
  const b = viewport.toCss(to);
  const places = kind === "plane" ? [a, { x: b.x, y: a.y }, b, { x: a.x, y: b.y }] : [a, b];
  const line = pathOf(places, kind === "plane");
  return svg`<g class="measured draft">
    <path class="under" d=${line}></path>
    <path class="line" d=${line}></path>
    ${kind === "plane" ? null : cross(a.x, a.y)}
  </g>`;
}

/**
 * Draw the places of a measurement that could not be made yet.
 * @param {MeasureKind} kind
 * @param {Point[]} points
 * @param {Viewport} viewport
 */
export function drawRefused(kind, points, viewport) {
  const places = points.map((point) => viewport.toCss(point));
  const [from, to] = points;
  return svg`<g class="measured draft refused">
    ${from && to ? drawDraft({ kind, from, to }, viewport) : null}
    ${places.map(({ x, y }) => cross(x, y))}
  </g>`;
}

/** @param {Point[]} places @param {boolean} closed */
function pathOf(places, closed) {
  return `M${places.map(({ x, y }) => `${x.toFixed(2)} ${y.toFixed(2)}`).join("L")}${closed ? "Z" : ""}`;
}

/** @param {number} x @param {number} y */
function cross(x, y) {
  const arms = `M${x - 6} ${y}H${x - 2}M${x + 2} ${y}H${x + 6}M${x} ${y - 6}V${y - 2}M${x} ${y + 2}V${y + 6}`;
  return svg`<g><path class="under" d=${arms}></path><path class="line" d=${arms}></path></g>`;
}

/**
 * Return where the value of a measurement is written, so that other labels can keep clear of it.
 * @param {MeasurementDocument} measured
 * @param {MeasuredView} view
 * @param {Viewport} viewport
 * @returns {Area}
 */
export function valueArea(measured, view, viewport) {
  const places = (measured.drawn_px[view] ?? []).map(([x, y]) => viewport.toCss({ x, y }));
  const { x, y, half } = valuePlace(valueText(measured), places, viewport.size);
  return { left: x - half, top: y - LABEL_HEIGHT_PX, right: x + half, bottom: y + 4 };
}

/**
 * Draw the value beside the first point, inside the view.
 * @param {string} text
 * @param {Point[]} places
 * @param {Size} box
 */
function label(text, places, box) {
  const { x, y } = valuePlace(text, places, box);
  return svg`<text class="value" x=${x} y=${y} text-anchor="middle">${text}</text>`;
}

/** @param {string} text @param {Point[]} places @param {Size} box */
function valuePlace(text, places, box) {
  const middle = { x: mean(places.map(({ x }) => x)), y: Math.min(...places.map(({ y }) => y)) };
  const half = Math.min((text.length * LETTER_PX) / 2 + 4, box.width / 2);
  const x = Math.min(box.width - half, Math.max(half, middle.x));
  const above = middle.y - 10 > LABEL_HEIGHT_PX;
  const y = above ? middle.y - 10 : Math.max(...places.map((place) => place.y)) + LABEL_HEIGHT_PX + 4;
  return { x, y: Math.min(box.height - 6, y), half };
}

/** @param {number[]} values */
function mean(values) {
  return values.reduce((sum, value) => sum + value, 0) / values.length;
}
