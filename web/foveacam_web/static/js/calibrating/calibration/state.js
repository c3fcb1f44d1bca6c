// State of the calibration page and its texts about the running procedure. Pure functions.

import { hasEnded } from "../../transport/jobs.js";

/** @import { CalibrationState, Work } from "#page" */

/** @type {Readonly<CalibrationState>} */
export const CALIBRATION_STATE = Object.freeze({
  wizard: null,
  records: null,
  health: null,
  sessions: null,
  session: null,
  pan_tilt: null,
  drift_checks: null,
  settle_time: null,
  displays: null,
  display_pattern: null,
  work: null,
  acceptance_page: false,
  acceptances: null,
});

/** The steps of a complete calibration, in their order. */
const STAGES = ["wide", "mirrors", "fit", "check", "settle"];

/** @param {Work | null} work */
export function isRunning(work) {
  return work !== null && !hasEnded(work.state);
}

/** Word which of the steps of a complete calibration runs ("step 2 of 5"); null otherwise. @param {Work} work */
export function placeOf({ step, stage }) {
  const index = STAGES.indexOf(stage);
  return step === "all" && index >= 0 ? `step ${index + 1} of ${STAGES.length}` : null;
}
