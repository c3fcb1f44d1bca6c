// The lines of the event log. Pure functions.

/** @import { EventDocument } from "#api" */

export const MOST = 200;
const NOISE = new Set([
  "fixation.step",
  "fixation.estimate",
  "mirrors.steered",
  "job.updated",
  "calibration.progress",
  "calibration.sample",
  "calibration.pose",
  "fault.changed",
  "fault.dismissed",
  "target.created",
  "cloud.created",
  "wide_depth.changed",
]); // shown elsewhere on the page, or told by the fixation that made it

/**
 * Return the log with an event added; the newest 200 are kept.
 * @param {EventDocument[]} log
 * @param {EventDocument} event
 * @returns {EventDocument[]}
 */
export function withEvent(log, event) {
  if (NOISE.has(event.kind) || log.some(({ id }) => id === event.id)) return log;
  return [...log.slice(1 - MOST), event];
}

/** Merge consecutive equal events into one line with a count. @param {EventDocument[]} log */
export function folded(log) {
  /** @type {{event: EventDocument, times: number}[]} */
  const lines = [];
  for (const event of log) {
    const last = lines.at(-1);
    if (last && last.event.kind === event.kind && last.event.message === event.message) {
      last.times += 1;
      last.event = event;
    } else lines.push({ event, times: 1 });
  }
  return lines;
}
