// State of the capture page and its texts about the running capture. Pure functions.

/** @import { CapturePageState, Capturing } from "#page" */

/** @type {Readonly<CapturePageState>} */
export const CAPTURE_STATE = Object.freeze({
  capture_page: false,
  captures: null,
  capturing: null,
  estimate: { stale: false, document: null, problem: null },
  plan_wished: null,
});

/** @param {Capturing | null} capturing */
export function isCapturing(capturing) {
  return capturing !== null && capturing.end === null;
}

/** Return the finished share; null while it is unknown. @param {Pick<Capturing, "progress">} capturing */
export function shareOf({ progress }) {
  return progress && progress.total > 0 && progress.phase !== "survey" ? progress.done / progress.total : null;
}
