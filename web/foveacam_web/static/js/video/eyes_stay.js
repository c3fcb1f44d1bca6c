// Whether the eyes still look where the last fixation left them: what its result says about an eye's view holds till then.

/** @import { ConsoleState, Overlay } from "#page" */

const SAME_DEG = 0.1;
const ARRIVING_MS = 600; // overlays that come later than this after a fixation's end are of the eyes at rest

/** Follows the fixation and the gaze of one page. */
export class EyesStay {
  #fixation_id = "";
  #ended_ms = 0;
  /** @type {Overlay["gaze"] | null} */
  #gaze = null;

  /**
   * Return whether they do, by a new state of the page.
   * @param {Pick<ConsoleState, "current" | "overlay">} state
   * @param {number} now_ms
   */
  update({ current, overlay }, now_ms = performance.now()) {
    const id = current?.fixation?.id ?? "";
    if (id !== this.#fixation_id) {
      this.#fixation_id = id;
      this.#ended_ms = now_ms;
      this.#gaze = null;
    }
    if (!overlay) return true;
    if (now_ms - this.#ended_ms < ARRIVING_MS || this.#gaze === null) this.#gaze = overlay.gaze;
    return same(this.#gaze.left, overlay.gaze.left) && same(this.#gaze.right, overlay.gaze.right);
  }
}

/** @param {Overlay["gaze"]["left"]} one @param {Overlay["gaze"]["left"]} other */
function same(one, other) {
  if (!one || !other) return one === other;
  return Math.max(Math.abs(one.ax_deg - other.ax_deg), Math.abs(one.ay_deg - other.ay_deg)) < SAME_DEG;
}
