// Spaces out the drawings of the 3D scene where the browser draws in software.
// viser draws for a quarter of a second after each change, as often as the browser can: eight pictures, nearly alike,
// of 30 ms on two cores. Six a second are enough there while the view is not being turned.

const SLOW_MS = 24; // a drawing that takes longer than a picture of a 60 Hz display was drawn in software
const STEP_MS = 160;
const TOUCHED_MS = 1000; // the view may go on turning this long after the last touch

/**
 * @typedef {(now_ms: number) => void} Draw
 * @typedef {{
 *   request: (draw: Draw) => number, cancel: (frame: number) => void, now: () => number,
 *   wait: (run: () => void, ms: number) => number, clear: (timer: number) => void
 * }} Clock
 */

/** Replaces `requestAnimationFrame` and `cancelAnimationFrame`; delays requests where the browser draws slowly. */
export class DrawingPace {
  #clock;
  #slow = false;
  #drawn_ms = Number.NEGATIVE_INFINITY;
  #touched_ms = Number.NEGATIVE_INFINITY;
  #drawing = false;
  #last = 0;
  /** @type {Map<number, () => void>} how to cancel each request that waits */
  #cancels = new Map();

  /** @param {Clock} clock */
  constructor(clock) {
    this.#clock = clock;
  }

  /** The user turns the view: draw as often as possible. */
  touch() {
    this.#touched_ms = this.#clock.now();
  }

  /** @param {Draw} draw @returns {number} what `cancel` takes */
  request(draw) {
    const id = ++this.#last;
    const rest_ms = this.#rest_ms();
    if (rest_ms > 0) {
      const timer = this.#clock.wait(() => this.#ask(id, draw, false), rest_ms);
      this.#cancels.set(id, () => this.#clock.clear(timer));
    } else {
      this.#ask(id, draw, this.#drawing);
    }
    return id;
  }

  /** @param {number} id */
  cancel(id) {
    this.#cancels.get(id)?.();
    this.#cancels.delete(id);
  }

  #rest_ms() {
    const now_ms = this.#clock.now();
    if (!this.#slow || now_ms - this.#touched_ms < TOUCHED_MS) return 0;
    return this.#drawn_ms + STEP_MS - now_ms;
  }

  /**
   * @param {number} id @param {Draw} draw
   * @param {boolean} follows whether a drawing asked for it, so that the time since then is that of drawing
   */
  #ask(id, draw, follows) {
    const frame = this.#clock.request((now_ms) => {
      this.#cancels.delete(id);
      const took_ms = now_ms - this.#drawn_ms;
      if (follows && took_ms > 0) this.#slow = took_ms > SLOW_MS;
      this.#drawn_ms = now_ms;
      this.#drawing = true;
      try {
        draw(now_ms);
      } finally {
        this.#drawing = false;
      }
    });
    this.#cancels.set(id, () => this.#clock.cancel(frame));
  }
}

/** Let a page draw at this pace. @param {Window} page */
export function paceDrawing(page) {
  const pace = new DrawingPace({
    request: page.requestAnimationFrame.bind(page),
    cancel: page.cancelAnimationFrame.bind(page),
    now: () => performance.now(),
    wait: (run, ms) => page.setTimeout(run, ms),
    clear: (timer) => page.clearTimeout(timer),
  });
  for (const type of ["pointerdown", "pointermove", "wheel", "keydown"]) {
    page.addEventListener(type, () => pace.touch(), { capture: true, passive: true });
  }
  page.requestAnimationFrame = (draw) => pace.request(draw);
  page.cancelAnimationFrame = (id) => pace.cancel(id);
}
