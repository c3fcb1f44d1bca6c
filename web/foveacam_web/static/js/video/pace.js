// Whether a live view stands still or comes too slowly, and why. Pure functions.

import { isRunning } from "../calibrating/calibration/state.js";
import { isCapturing } from "../capturing/capture/state.js";
import { number } from "../elements/format.js";

/**
 * @import { ConsoleState, ViewName } from "#page"
 * @typedef {{frozen: true, for_ms: number} | {frozen: false, text: string, reason: string}} Trouble
 */

const SILENT_MS = 2500;
/** A view was subscribed this long before its rate counts; before it counts as frozen, `SILENT_MS`. */
const SETTLED_MS = 5000;
const SLOW_SHARE = 0.5;

/**
 * Return what is wrong with the pace of a live view that shows pictures; null while nothing is.
 * @param {Pick<ConsoleState, "shown" | "server_stats" | "work" | "capturing">} state
 * @param {ViewName} name
 * @returns {Trouble | null}
 */
export function paceOf(state, name) {
  const [shown, served] = [state.shown[name], state.server_stats[name]];
  if (!shown || shown.count === 0 || shown.watched_ms === null) return null;
  // a procedure triggers the foveae only when it needs a look
  if ((isRunning(state.work) || isCapturing(state.capturing)) && name !== "wide") return null;
  const frozen_ms = served?.frozen_since_ms ?? (shown.frozen || shown.silent_ms > SILENT_MS ? shown.silent_ms : null);
  if (frozen_ms !== null && shown.watched_ms < SILENT_MS) return null; // on its way
  if (frozen_ms !== null) return { frozen: true, for_ms: frozen_ms };
  if (served?.slow_reason && served.expected_hz)
    return { frozen: false, text: slowWords(served.rate_hz ?? 0, served.expected_hz), reason: served.slow_reason };
  const [sent, taken] = [served?.rate_hz ?? 0, shown.fps];
  if (!served?.expected_hz || shown.watched_ms < SETTLED_MS || taken >= SLOW_SHARE * sent) return null;
  return {
    frozen: false,
    text: slowWords(taken, sent),
    reason: "this browser, or the line to it, takes no more pictures than that",
  };
}

/** @param {number} found_hz @param {number} wanted_hz */
function slowWords(found_hz, wanted_hz) {
  return `Slow: ${number(found_hz, found_hz < 1 ? 1 : 0)} of ${number(wanted_hz, 0)} fps`;
}
