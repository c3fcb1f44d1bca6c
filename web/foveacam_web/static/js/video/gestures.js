// Turns pointer events on the wide view into gestures: click, rectangle, steer, pan, zoom, hover.
// All positions are CSS pixels from the surface's top left corner.

/**
 * @import { Point } from "#page"
 * @typedef {{
 *   click(at: Point): void, probe(at: Point): void, hover(at: Point | null): void,
 *   rectangle(from: Point, to: Point, done: boolean): void, rectangleCancelled(): void,
 *   steer(at: Point, done: boolean): void,
 *   pan(dx: number, dy: number): void, zoom(at: Point, factor: number): void, fit(): void,
 * }} Meanings
 * @typedef {"undecided" | "rectangle" | "steer" | "pan" | "pinch" | "ignored"} Gesture
 */

const SLACK_PX = 4; // a press that moves less is a click
const TOUCH_SLACK_PX = 10;
const LONG_PRESS_MS = 420;
const DOUBLE_MS = 350;
const DOUBLE_PX = 12; // two quick clicks further apart are two single clicks
const WHEEL_STEP = 0.0022;

/** The gestures of one surface. */
export class Gestures {
  #surface;
  #mean;
  /** @type {Map<number, Point>} */
  #pointers = new Map();
  /** @type {Gesture} */
  #gesture = "ignored";
  /** @type {Point} */
  #from = { x: 0, y: 0 };
  #held = 0;
  /** @type {{at: Point, t_ms: number} | null} */
  #last_click = null;

  /** @param {HTMLElement} surface @param {Meanings} mean */
  constructor(surface, mean) {
    this.#surface = surface;
    this.#mean = mean;
    surface.addEventListener("pointerdown", (event) => this.#down(event));
    surface.addEventListener("pointermove", (event) => this.#move(event));
    surface.addEventListener("pointerup", (event) => this.#up(event));
    surface.addEventListener("pointercancel", (event) => this.#cancel(event));
    surface.addEventListener("pointerleave", () => mean.hover(null));
    surface.addEventListener("wheel", (event) => this.#wheel(event), { passive: false });
    surface.addEventListener("contextmenu", (event) => this.#menu(event));
    // The page scrolls under one finger unless that finger draws, and never under two.
    surface.addEventListener(
      "touchmove",
      (event) => (event.touches.length > 1 || this.#gesture === "rectangle") && event.preventDefault(),
      { passive: false },
    );
  }

  /** Cancel the gesture in progress. */
  abandon() {
    if (this.#gesture === "rectangle") this.#mean.rectangleCancelled();
    if (this.#gesture === "steer") this.#mean.steer(this.#from, true);
    this.#gesture = "ignored";
  }

  /** @param {MouseEvent} event */
  #at(event) {
    const box = this.#surface.getBoundingClientRect();
    return { x: event.clientX - box.left, y: event.clientY - box.top };
  }

  /** @param {PointerEvent} event */
  #down(event) {
    const at = this.#at(event);
    this.#pointers.set(event.pointerId, at);
    if (this.#pointers.size === 2) {
      this.abandon();
      clearTimeout(this.#held);
      this.#gesture = "pinch";
      return;
    }
    if (this.#pointers.size > 2) return;
    this.#from = at;
    this.#gesture = firstGuess(event);
    if (this.#gesture !== "ignored") this.#surface.setPointerCapture(event.pointerId);
    if (this.#gesture === "steer") this.#mean.steer(at, false);
    if (this.#gesture === "pan") event.preventDefault(); // the middle button would start the browser's own scrolling
    if (event.pointerType === "touch") {
      this.#held = setTimeout(() => this.#pressLong(), LONG_PRESS_MS);
    }
  }

  #pressLong() {
    if (this.#gesture !== "undecided") return;
    this.#gesture = "rectangle";
    navigator.vibrate?.(15);
    this.#mean.rectangle(this.#from, this.#from, false);
  }

  /** @param {PointerEvent} event */
  #move(event) {
    const at = this.#at(event);
    const before = this.#pointers.get(event.pointerId);
    if (!before) {
      if (event.pointerType !== "touch") this.#mean.hover(at);
      return;
    }
    if (this.#gesture === "pinch") this.#pinch(event.pointerId, before, at);
    this.#pointers.set(event.pointerId, at);
    if (this.#gesture === "undecided") this.#decide(event, at);
    if (this.#gesture === "rectangle") this.#mean.rectangle(this.#from, at, false);
    else if (this.#gesture === "steer") this.#mean.steer(at, false);
    else if (this.#gesture === "pan") this.#mean.pan(at.x - before.x, at.y - before.y);
    if (event.pointerType !== "touch") this.#mean.hover(at);
  }

  /** @param {PointerEvent} event @param {Point} at */
  #decide(event, at) {
    const touch = event.pointerType === "touch";
    if (apart(this.#from, at) <= (touch ? TOUCH_SLACK_PX : SLACK_PX)) return;
    clearTimeout(this.#held);
    this.#gesture = touch ? "ignored" : "rectangle";
  }

  /** @param {number} moved @param {Point} before @param {Point} at */
  #pinch(moved, before, at) {
    const other = [...this.#pointers].find(([id]) => id !== moved)?.[1];
    if (!other) return;
    this.#mean.pan((at.x - before.x) / 2, (at.y - before.y) / 2);
    const middle = { x: (at.x + other.x) / 2, y: (at.y + other.y) / 2 };
    this.#mean.zoom(middle, apart(at, other) / Math.max(1, apart(before, other)));
  }

  /** @param {PointerEvent} event */
  #up(event) {
    clearTimeout(this.#held);
    if (!this.#pointers.delete(event.pointerId)) return;
    const gesture = this.#gesture;
    if (this.#pointers.size > 0) {
      this.#gesture = "ignored"; // the finger that remains of a pinch is ignored
      return;
    }
    this.#gesture = "ignored";
    if (gesture === "undecided") this.#click(event);
    else if (gesture === "rectangle") this.#mean.rectangle(this.#from, this.#at(event), true);
    else if (gesture === "steer") this.#mean.steer(this.#at(event), true);
  }

  /** @param {PointerEvent} event */
  #click(event) {
    const last = this.#last_click;
    const double = last && event.timeStamp - last.t_ms < DOUBLE_MS && apart(last.at, this.#from) < DOUBLE_PX;
    this.#last_click = double ? null : { at: this.#from, t_ms: event.timeStamp };
    if (double) this.#mean.fit();
    else this.#mean.click(this.#from); // the point of the press, not of the release
  }

  /** @param {PointerEvent} event */
  #cancel(event) {
    clearTimeout(this.#held);
    this.#pointers.delete(event.pointerId);
    this.abandon();
  }

  /** @param {WheelEvent} event */
  #wheel(event) {
    event.preventDefault();
    const lines = event.deltaMode === WheelEvent.DOM_DELTA_LINE ? 16 : 1;
    const gain = event.ctrlKey ? 5 * WHEEL_STEP : WHEEL_STEP; // a trackpad's pinch comes as small wheel steps with Ctrl
    this.#mean.zoom(this.#at(event), Math.exp(-event.deltaY * lines * gain));
  }

  /** @param {MouseEvent} event */
  #menu(event) {
    event.preventDefault();
    if (this.#pointers.size === 0 || event.button === 2) this.#mean.probe(this.#at(event));
  }
}

/** @param {PointerEvent} event @returns {Gesture} */
function firstGuess(event) {
  if (event.button === 1 || (event.button === 0 && event.shiftKey)) return "pan";
  if (event.button !== 0) return "ignored";
  return event.altKey ? "steer" : "undecided";
}

/** @param {Point} a @param {Point} b */
function apart(a, b) {
  return Math.hypot(a.x - b.x, a.y - b.y);
}
