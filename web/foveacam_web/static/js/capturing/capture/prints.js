// Draws the footprints of a plan over the live wide view, left and right in their colours, with the path of the
// mirrors. Pointer, finger or arrow keys select a point, whose figures are shown.

import { h, setText } from "../../elements/dom.js";
import { angle, count, number } from "../../elements/format.js";
import { placeOf } from "./plan.js";
import { percent } from "./words.js";

/**
 * @import { Corners, Estimate, Point, Store } from "#console"
 * @import { Pane } from "../../video/pane.js"
 */

const MANY = 1500; // more outlines than this cannot be told apart
const FILL = 0.13; // opacity of one view; overlapping views add up
const STEPS = Object.freeze(
  /** @type {Record<string, number>} */ ({ ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 }),
);

/** The footprints over one pane. */
export class PlanPrints {
  #pane;
  #canvas = h("canvas", { class: "plan-prints", tabindex: 0, role: "application" });
  #tip = h("p", { class: "plan-tip", role: "status", hidden: true });
  /** @type {Estimate | null} */
  #estimate = null;
  /** @type {number | null} */
  #chosen = null;

  /** @param {Pane} pane @param {Store} store */
  constructor(pane, store) {
    this.#pane = pane;
    pane.element.append(this.#canvas, this.#tip);
    const placed = pane.placed;
    pane.placed = () => {
      placed();
      this.#draw();
    };
    this.#canvas.addEventListener("pointermove", (event) => this.#point(event));
    this.#canvas.addEventListener("pointerdown", (event) => this.#point(event));
    this.#canvas.addEventListener("pointerleave", () => this.#choose(null));
    this.#canvas.addEventListener("blur", () => this.#choose(null));
    this.#canvas.addEventListener("keydown", (event) => this.#key(event));
    store.on(["estimate", "capture_page"], ({ estimate, capture_page }) => {
      const document = capture_page ? estimate.document : null;
      this.#canvas.hidden = !capture_page;
      this.#canvas.classList.toggle("stale", estimate.stale);
      if (document === this.#estimate) return;
      this.#estimate = document;
      this.#canvas.dataset["points"] = String(document?.coverage.footprints.length ?? 0);
      this.#canvas.setAttribute("aria-label", document ? summary(document) : "No footprints yet");
      this.#choose(null);
      this.#draw();
    });
  }

  /** @param {PointerEvent} event */
  #point(event) {
    const { left, top } = this.#canvas.getBoundingClientRect();
    const pixel = this.#pane.viewport.toSensor({ x: event.clientX - left, y: event.clientY - top });
    const prints = this.#estimate?.coverage.footprints ?? [];
    let nearest = Infinity;
    let found = null;
    prints.forEach(({ left: one, right: other }, number) => {
      if (!holds(one, pixel) && !holds(other, pixel)) return;
      const away = distance(middleOf(one, other), pixel);
      if (away < nearest) [nearest, found] = [away, number];
    });
    this.#choose(found);
  }

  /** @param {KeyboardEvent} event */
  #key(event) {
    const step = STEPS[event.key];
    const points = this.#estimate?.coverage.footprints.length ?? 0;
    if (!step || points === 0) return;
    event.preventDefault();
    this.#choose(this.#chosen === null ? (step > 0 ? 0 : points - 1) : (this.#chosen + step + points) % points);
  }

  /** @param {number | null} number */
  #choose(number) {
    if (number === this.#chosen) return;
    this.#chosen = number;
    this.#tip.hidden = number === null;
    if (number !== null && this.#estimate) setText(this.#tip, wordsOf(this.#estimate, number));
    this.#draw();
  }

  #draw() {
    const { surface, viewport } = this.#pane;
    if (this.#canvas.hidden) return;
    const [width, height] = [surface.clientWidth, surface.clientHeight];
    const device = devicePixelRatio;
    Object.assign(this.#canvas, { width: Math.round(width * device), height: Math.round(height * device) });
    Object.assign(this.#canvas.style, {
      top: `${surface.offsetTop}px`,
      left: `${surface.offsetLeft}px`,
      width: `${width}px`,
      height: `${height}px`,
    });
    const context = this.#canvas.getContext("2d");
    if (!context || !this.#estimate) return;
    context.scale(device, device);
    const colours = getComputedStyle(this.#pane.element);
    const { footprints } = this.#estimate.coverage;
    const toCss = (/** @type {[number, number]} */ [x, y]) => viewport.toCss({ x, y });
    for (const eye of /** @type {const} */ (["left", "right"])) {
      context.fillStyle = context.strokeStyle = colours.getPropertyValue(`--${eye}-on-picture`);
      for (const print of footprints)
        paint(context, print[eye].map(toCss), { line_px: footprints.length > MANY ? 0 : 1, dashed: eye === "right" });
    }
    drawWay(
      context,
      footprints.map(({ left, right }) => middleOf(left, right)).map(({ x, y }) => viewport.toCss({ x, y })),
    );
    const chosen = this.#chosen === null ? undefined : footprints[this.#chosen];
    for (const eye of /** @type {const} */ (["left", "right"])) {
      context.fillStyle = context.strokeStyle = colours.getPropertyValue(`--${eye}-on-picture`);
      if (chosen) paint(context, chosen[eye].map(toCss), { line_px: 3, dashed: eye === "right" });
    }
  }
}

/**
 * @param {CanvasRenderingContext2D} context
 * @param {Point[]} corners CSS px
 * @param {{line_px: number, dashed: boolean}} how
 */
function paint(context, corners, { line_px, dashed }) {
  context.beginPath();
  for (const { x, y } of corners) context.lineTo(x, y);
  context.closePath();
  context.globalAlpha = FILL;
  context.fill();
  if (line_px === 0) return;
  context.globalAlpha = line_px > 1 ? 1 : 0.8;
  context.lineWidth = line_px;
  context.setLineDash(dashed ? [7, 3] : []);
  context.stroke();
}

/** @param {CanvasRenderingContext2D} context @param {Point[]} stops CSS px */
function drawWay(context, stops) {
  if (stops.length > MANY) return;
  context.setLineDash([]);
  context.globalAlpha = 0.55;
  context.strokeStyle = context.fillStyle = "#fff";
  context.lineWidth = 1;
  context.beginPath();
  for (const { x, y } of stops) context.lineTo(x, y);
  context.stroke();
  context.globalAlpha = 0.9;
  for (const { x, y } of stops) context.fillRect(x - 1.5, y - 1.5, 3, 3);
}

/** Return whether a convex polygon contains a point. @param {Corners} corners @param {Point} point */
function holds(corners, { x, y }) {
  const sides = corners.map(([ax, ay], index) => {
    const [bx, by] = corners[(index + 1) % corners.length] ?? [ax, ay];
    return (bx - ax) * (y - ay) - (by - ay) * (x - ax);
  });
  return sides.every((side) => side >= 0) || sides.every((side) => side <= 0);
}

/** @param {Corners} one @param {Corners} other */
function middleOf(one, other) {
  const all = [...one, ...other];
  return {
    x: all.reduce((sum, [x]) => sum + x, 0) / all.length,
    y: all.reduce((sum, [, y]) => sum + y, 0) / all.length,
  };
}

/** @param {Point} a @param {Point} b */
function distance(a, b) {
  return Math.hypot(a.x - b.x, a.y - b.y);
}

/** @param {Estimate} estimate */
function summary({ coverage }) {
  return `Footprints of ${count(coverage.footprints.length)} points: ${percent(coverage.seen_either)} of the field is seen, ${percent(coverage.seen_both)} by both eyes. Arrow keys go from point to point.`;
}

/** @param {Estimate} estimate @param {number} index */
function wordsOf({ plan: { points, verging } }, index) {
  const name = `Point ${index}`; // counted from 0, as in datasets and refusals
  if (points.kind === "set_points") {
    const point = points.points[index];
    const far = point?.distance_m ?? verging.distance_m;
    return [
      name,
      `${angle(point?.ax_deg)} ${angle(point?.ay_deg)}`,
      far === "infinity" ? "parallel" : `${number(far, 2)} m`,
      point?.shift_deg ? `shift ${angle(point.shift_deg)}` : "",
    ]
      .filter(Boolean)
      .join(" · ");
  }
  const { column, row } = placeOf(points, index);
  const along = (
    /** @type {number} */ k,
    /** @type {number} */ n,
    /** @type {number} */ centre,
    /** @type {number | null} */ half,
  ) => (n === 1 ? centre : centre + ((half ?? 0) * (2 * k - (n - 1))) / (n - 1));
  const ax_deg = along(column, points.columns, points.centre_ax_deg, points.half_width_deg);
  const ay_deg = along(row, points.rows, points.centre_ay_deg, points.half_height_deg);
  return `${name} · column ${column}, row ${row} · ${angle(ax_deg)} ${angle(ay_deg)}`;
}
