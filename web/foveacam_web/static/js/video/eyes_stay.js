// Whether the eyes still look where the last fixation left them: what its result says about an eye's view holds till then.

/**
 * @import { FixationDocument } from "#api"
 * @import { ConsoleState, Overlay } from "#page"
 */

const SAME_DEG = 0.1;
const ARRIVING_MS = 600; // overlays that come later than this after a fixation's end are of the eyes at rest
const EARLIER_MS = 5000; // a fixation that is older when the page hears of it: the eyes may look elsewhere since

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
      const earlier = current?.fixation ? lookOf(current.fixation) : null;
      this.#ended_ms = earlier ? -Infinity : now_ms;
      this.#gaze = earlier;
    }
    if (!overlay) return true;
    if (now_ms - this.#ended_ms < ARRIVING_MS || this.#gaze === null) this.#gaze = overlay.gaze;
    return same(this.#gaze.left, overlay.gaze.left) && same(this.#gaze.right, overlay.gaze.right);
  }
}

/** Return where an earlier fixation looked last; null of one that has just ended. @param {FixationDocument} fixation */
function lookOf({ created_utc, duration_ms, steps }) {
  const last = steps.at(-1);
  if (!last || Date.now() - Date.parse(created_utc) - (duration_ms ?? 0) < EARLIER_MS) return null;
  return {
    left: { ax_deg: last.left_ax_deg, ay_deg: last.left_ay_deg },
    right: { ax_deg: last.right_ax_deg, ay_deg: last.right_ay_deg },
  };
}

/** @param {Overlay["gaze"]["left"]} one @param {Overlay["gaze"]["left"]} other */
function same(one, other) {
  if (!one || !other) return one === other;
  return Math.max(Math.abs(one.ax_deg - other.ax_deg), Math.abs(one.ay_deg - other.ay_deg)) < SAME_DEG;
}
