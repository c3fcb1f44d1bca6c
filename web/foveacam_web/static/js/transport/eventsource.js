// Receives the server's events (SSE), reconnects within two seconds, and reports when the connection opens or breaks.
// A browser that is signed out does not reconnect until the page requests it.

import { RequestError, whoAmI } from "./api.js";
import { API, parsed } from "../root.js";

/**
 * @import { EventDocument } from "#api"
 * @typedef {{type: "event", event: EventDocument} | {type: "link", open: boolean} | {type: "signed_out"}} EventNews
 * @typedef {{again: () => void}} EventLink `again`: connect again after the browser was signed out
 */

const FIRST_RETRY_MS = 250;
const LAST_RETRY_MS = 2000;
const KINDS = [
  "message",
  "rig.state",
  "fixation.step",
  "fixation.estimate",
  "fixation.done",
  "fixation.updated",
  "cloud.created",
  "target.created",
  "target.updated",
  "target.deleted",
  "job.updated",
  "lease.asked",
  "lease.changed",
  "stop.engaged",
  "stop.released",
  "device.fault",
  "device.recovered",
  "mirrors.steered",
  "mirrors.parked",
  "rig.calibration",
  "fixation.selected",
  "cloud.deleted",
  "viewer.failed",
  "calibration.progress",
  "calibration.sample",
  "calibration.pose",
  "calibration.fitted",
  "calibration.health",
  "calibration.drift",
  "calibration.acceptance",
  "pan_tilt.moved",
  "pan_tilt.zero_confirmed",
  "rail.zero_confirmed",
  "cloud.failed",
  "storage.fault",
  "storage.recovered",
  "fault.changed",
  "fault.dismissed",
  "rig.settle_time",
  "rig.setup",
  "rig.binning",
  "camera.self_test",
  "camera.settings",
  "mirrors.recovered",
  "mirrors.switched",
  "rail.moved",
  "simulation.faults",
  "capture.created",
  "capture.progress",
  "capture.updated",
  "capture.removed",
  "capture.ended",
  "recording.created",
  "recording.imported",
  "recording.progress",
  "recording.updated",
  "recording.removed",
  "recording.ended",
  "still.taken",
  "still.kept",
  "still.updated",
  "still.removed",
  "mosaic.begun",
  "mosaic.ended",
  "mosaic.shown",
  "mosaic.hidden",
  "mosaic.removed",
  "reference.begun",
  "reference.ended",
  "reference.removed",
  "export.begun",
  "export.ended",
  "export.removed",
  "measurement.created",
  "measurement.updated",
  "measurement.deleted",
  "wide_depth.changed",
  "wide_depth.surveyed",
  "follow.started",
  "follow.changed",
  "follow.refused",
  "follow.ended",
  "follow.round",
  "loop.started",
  "loop.ended",
  "loop.latched",
  "loop.tuned",
  "depth.backend",
  "depth.fallback",
  "display.pattern",
  "display.changed",
];

/**
 * Listen to the events for as long as the page or worker lives.
 * @param {(news: EventNews) => void} onNews
 * @returns {EventLink}
 */
export function keepEvents(onNews) {
  let [retry_ms, halted] = [FIRST_RETRY_MS, false];
  const retry = async (/** @type {boolean} */ refused) => {
    if (refused && (await isSignedOut())) {
      halted = true;
      onNews({ type: "signed_out" });
      return;
    }
    setTimeout(open, retry_ms);
    retry_ms = Math.min(LAST_RETRY_MS, retry_ms * 2);
  };
  const open = () => {
    halted = false;
    const source = new EventSource(`${API}/events`);
    source.onopen = () => {
      retry_ms = FIRST_RETRY_MS;
      onNews({ type: "link", open: true });
    };
    source.onerror = () => {
      const refused = source.readyState === EventSource.CLOSED; // an HTTP error; after a broken connection it would try again
      source.close(); // the browser's own retry waits three seconds, and never after an HTTP error
      onNews({ type: "link", open: false });
      void retry(refused);
    };
    for (const kind of KINDS) {
      source.addEventListener(kind, (message) => onNews({ type: "event", event: parsed(message.data) }));
    }
  };
  open();
  return { again: () => halted && open() };
}

/** Ask the server whether this browser is signed out; not, while the server does not answer. */
async function isSignedOut() {
  try {
    return (await whoAmI()).kind === "nobody";
  } catch (error) {
    if (error instanceof RequestError) return false;
    throw error;
  }
}
