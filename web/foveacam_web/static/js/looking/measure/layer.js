// The layer over one view while the measuring tool is on: handles its clicks and drags, and draws the measurements.

import { fill, h, html, s } from "../../elements/dom.js";
import { drawDraft, drawMeasurement, drawRefused } from "./drawing.js";
import { visibleIn } from "./state.js";

/**
 * @import { PlaceRequest } from "#api"
 * @import { ConsoleState, MeasureKind, MeasuredView, Point } from "#page"
 * @import { Pane } from "../../video/pane.js"
 * @typedef {{kind(): MeasureKind | null, start(): Point | null, refused(): PlaceRequest[], click(at: Point): void, drag(from: Point, to: Point): void}} Meaning
 */

const SLACK_PX = 6; // CSS px; a press that moves less is a click

/** The layer of one view. */
export class MeasureLayer {
  #pane;
  #view;
  #mean;
  #marks = s("g", {});
  #draft = s("g", {});
  /** The pointers that are down, with the events that put them down. @type {Map<number, PointerEvent>} */
  #pointers = new Map();
  /** Whether two fingers are on it, or were since all were up: they zoom and move the picture below. */
  #pinching = false;
  /** @type {Point | null} where the press began, CSS px */
  #from = null;

  /** @param {Pane} pane @param {MeasuredView} view @param {Meaning} mean */
  constructor(pane, view, mean) {
    this.#pane = pane;
    this.#view = view;
    this.#mean = mean;
    this.element = h(
      "div",
      { class: "measure-layer" },
      html`<svg class="measure-marks" aria-hidden="true">${this.#marks}${this.#draft}</svg>`,
    );
    pane.surface.append(this.element);
    for (const kind of ["pointerdown", "pointermove", "pointerup", "pointercancel"]) {
      this.element.addEventListener(kind, (event) => this.#onPointer(/** @type {PointerEvent} */ (event)));
    }
    // zoom, pan and resizing move the picture without an event
    new MutationObserver(() => this.redraw()).observe(pane.canvas, { attributes: true, attributeFilter: ["style"] });
  }

  /** Repeat the last drawing. */
  redraw = () => {};

  /** @param {ConsoleState} state */
  draw(state) {
    this.redraw = () => {
      const { viewport } = this.#pane;
      const box = { width: this.#pane.surface.clientWidth, height: this.#pane.surface.clientHeight };
      const chosen = state.selected_measurement;
      const shown = visibleIn(state, this.#view).sort((a, b) => Number(a.id === chosen) - Number(b.id === chosen));
      fill(
        this.#marks,
        ...shown.map((measured) =>
          drawMeasurement(measured, this.#view, viewport, { selected: measured.id === chosen, box }),
        ),
      );
      if (!state.measuring) fill(this.#draft);
      else this.#drawDraft(null);
    };
    this.redraw();
  }

  /** @param {PointerEvent} event */
  #onPointer(event) {
    if (event.type === "pointerdown" && event.button === 0) this.#count(event);
    if (!this.#pinching) event.stopPropagation(); // a click that measures does not fixate
    const box = this.element.getBoundingClientRect();
    const at = { x: event.clientX - box.left, y: event.clientY - box.top };
    if (event.type === "pointerdown") this.#down(event, at);
    else if (event.type === "pointermove") this.#move(event, at);
    else if (event.type === "pointerup") this.#up(event, at);
    else this.#abandon(event.pointerId);
    if (this.#pointers.size === 0) this.#pinching = false;
  }

  /** Note a finger; with the second one tell the picture of the first, which it has not heard of. @param {PointerEvent} event */
  #count(event) {
    const [first] = this.#pointers.values();
    if (first && !this.#pinching) {
      this.#pinching = true;
      this.#pane.surface.dispatchEvent(new PointerEvent("pointerdown", first));
    }
    this.#pointers.set(event.pointerId, event);
  }

  /** @param {PointerEvent} event @param {Point} at */
  #down(event, at) {
    if (event.button !== 0) return;
    this.element.setPointerCapture(event.pointerId);
    this.#from = this.#pinching ? null : at;
    this.#drawDraft(null);
  }

  /** @param {PointerEvent} event @param {Point} at */
  #move(event, at) {
    const pressed = this.#pointers.has(event.pointerId);
    if (pressed && this.#from) this.#drawDraft(at);
    else if (!pressed && this.#mean.start()) this.#drawDraft(at);
  }

  /** @param {PointerEvent} event @param {Point} at */
  #up(event, at) {
    const from = this.#from;
    this.#abandon(event.pointerId);
    if (!from) return;
    const { viewport } = this.#pane;
    const moved = Math.hypot(at.x - from.x, at.y - from.y) > SLACK_PX;
    if (moved && this.#mean.kind() !== "point") this.#mean.drag(viewport.toSensor(from), viewport.toSensor(at));
    else this.#mean.click(viewport.toSensor(from));
  }

  /** @param {number} pointer */
  #abandon(pointer) {
    this.#pointers.delete(pointer);
    this.#from = null;
    this.#drawDraft(null);
  }

  /** @param {Point | null} at CSS px */
  #drawDraft(at) {
    const { viewport } = this.#pane;
    const kind = this.#mean.kind();
    const start = this.#from ? viewport.toSensor(this.#from) : this.#mean.start();
    const refused = this.#mean.refused().map(({ x_px, y_px }) => ({ x: x_px, y: y_px }));
    if (!start && kind && refused.length) return fill(this.#draft, drawRefused(kind, refused, viewport));
    if (!kind || kind === "point" || !start) return fill(this.#draft);
    fill(this.#draft, drawDraft({ kind, from: start, to: at ? viewport.toSensor(at) : start }, viewport));
  }
}
