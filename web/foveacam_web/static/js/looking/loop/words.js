// Words of the vergence loop: its status, figures, trigger, tuning and messages. Pure functions.

import { distanceText, MISSING, millis, number, sentence, timeLeft } from "../../elements/format.js";

/**
 * @import { EventDocument, LoopAxisDocument, LoopDocument, LoopTriggerDocument, LoopTuneDocument } from "#api"
 * @import { Job } from "#page"
 * @import { ScaleKind } from "../../devices/rig/scale.js"
 * @import { Message } from "../../elements/toasts.js"
 * @typedef {LoopAxisDocument["axis"]} AxisName
 */

/** @type {Readonly<Record<LoopDocument["status"], {tone: "good" | "warn" | "bad" | "plain", text: string}>>} */
export const STATUSES = Object.freeze({
  off: { tone: "plain", text: "Off" },
  initializing: { tone: "plain", text: "Starting" },
  tracking: { tone: "good", text: "Tracking" },
  low_score: { tone: "warn", text: "Low score" },
  match_stale: { tone: "warn", text: "Wide view too old" },
  pair_skew: { tone: "warn", text: "Foveae apart in time" },
  tracker_lost: { tone: "warn", text: "Tracker lost" },
  out_of_reach: { tone: "warn", text: "Out of reach" },
  frozen: { tone: "plain", text: "Frozen" },
  held: { tone: "plain", text: "Paused" },
  manual: { tone: "plain", text: "By hand" },
  trigger_fault: { tone: "bad", text: "Trigger fault" },
  auto_tune: { tone: "plain", text: "Tuning" },
  split: { tone: "plain", text: "Eyes apart" },
  waiting: { tone: "plain", text: "Waiting" },
});

/** Hints for states in which the server gives no detail, as nothing is wrong. @type {Readonly<Partial<Record<LoopDocument["status"], string>>>} */
const HINTS = Object.freeze({
  off: "Click in the wide view: both foveae then stay on what is there.",
  initializing: "Both foveae look for the target first.",
  held: "The eyes keep looking and measuring; nothing is corrected.",
  manual: "Both eyes look in parallel where the pointer drags. On release the loop resumes its target.",
  split: "Each eye keeps the point clicked in its picture in the middle; an eye without one does not move.",
  auto_tune: "The gains are being found; the eyes oscillate about the target meanwhile.",
});

/** @type {readonly {axis: AxisName, name: string, kind: ScaleKind, title: string}[]} */
export const AXES = Object.freeze([
  {
    axis: "pan_x",
    name: "Pan x",
    kind: "linear",
    title: "Angle of both eyes to the right of the target in the wide view.",
  },
  {
    axis: "pan_y",
    name: "Pan y",
    kind: "linear",
    title: "Angle of both eyes below the target in the wide view.",
  },
  {
    axis: "verge",
    name: "Vergence",
    kind: "root",
    title: "Angle between both lines of sight; it determines the distance. 0 is parallel.",
  },
  {
    axis: "shift_y",
    name: "Vertical shift",
    kind: "linear",
    title: "Half the angle by which the left eye looks lower than the right.",
  },
]);

const AXIS_NAMES = Object.fromEntries(AXES.map(({ axis, name }) => [axis, name]));
const EYES = Object.freeze({ left: "Left eye", right: "Right eye" });
const EYE_STATES = Object.freeze({ still: "rests", tracking: "tracking", lost: "lost" });
const TARGETS = Object.freeze({ fixed: "fixed", tracked: "tracked", lost: "lost" });

/** Return the status's remedy or description. @param {LoopDocument} loop */
export function detailOf({ status, detail }) {
  return sentence(detail) || (HINTS[status] ?? "");
}

/** @param {LoopDocument} loop */
export function distanceOf({ distance_m, distance_sigma_m }) {
  return distanceText(distance_m, distance_sigma_m);
}

/** Return the distance at which both eyes meet. @param {number} verge_deg @param {number | null | undefined} baseline_m */
export function meetingText(verge_deg, baseline_m) {
  if (!baseline_m) return "";
  if (verge_deg <= 0) return "parallel";
  const distance_m = baseline_m / ((verge_deg * Math.PI) / 180);
  return `${Number(distance_m.toPrecision(3))} m`;
}

/** @param {number | null} error_deg */
export function errorText(error_deg) {
  return error_deg === null ? MISSING : `${number(error_deg, 4)}°`;
}

/**
 * Return the name and value of each figure of the status.
 * @param {LoopDocument} loop
 * @returns {[string, string][]}
 */
export function figuresOf({ axes, eyes, score_left, score_right, rate_hz, lead_ms, target, fine, looks }) {
  if (eyes.length > 0) return [["Looks", `${number(rate_hz, 1)} /s`], ...eyes.map(eyeFigure)];
  const verge_deg = axes.find(({ axis }) => axis === "verge")?.command_deg;
  const score = target?.tracker_score ?? null;
  return [
    ["Vergence", looks === 0 || verge_deg === undefined ? MISSING : `${number(verge_deg, 3)}°`],
    ["Scores, left and right", `${number(score_left, 2)}, ${number(score_right, 2)}`],
    ["Looks", looks === 0 ? MISSING : `${number(rate_hz, 1)} /s`],
    ["Lead", millis(lead_ms)],
    [
      "Target",
      target
        ? [TARGETS[target.state], score !== null && `score ${number(score, 2)}`].filter(Boolean).join(", ")
        : MISSING,
    ],
    ["Measured by", fine === null ? MISSING : fine ? "both foveae" : "the strip alone"],
  ];
}

/** @param {LoopDocument["eyes"][number]} eye @returns {[string, string]} */
function eyeFigure({ eye, state, score }) {
  return [EYES[eye], score === null ? EYE_STATES[state] : `${EYE_STATES[state]}, score ${number(score, 2)}`];
}

/**
 * Return the name and value of each figure of the trigger.
 * @param {LoopTriggerDocument} trigger
 * @returns {[string, string][]}
 */
export function triggerFigures({ exposures, failures, in_a_row, pair_skew_us, after_trigger_us, wide_age_ms }) {
  const known = exposures > 0;
  return [
    ["Exposures", known ? String(exposures) : MISSING],
    ["Failures", known ? `${failures}${in_a_row > 0 ? `, ${in_a_row} in a row` : ""}` : MISSING],
    ["Left after right", known ? `${number(pair_skew_us, 0)} µs` : MISSING],
    ["Pulse to exposure", after_trigger_us === null ? MISSING : `${number(after_trigger_us, 0)} µs`],
    ["Wide after foveae", wide_age_ms === null ? MISSING : `${number(wide_age_ms, 1)} ms`],
  ];
}

/** Return why the loop cannot be tuned now, or null. @param {LoopDocument | null} loop */
export function whyNotTuned(loop) {
  if (!loop?.running || loop.target === null) return "Choose a target first.";
  if (loop.eyes.length > 0) return "Unite the eyes first.";
  if (loop.paused) return "The loop is paused.";
  return loop.trigger.latched ? "Reset the trigger first." : null;
}

/**
 * Return the progress or the outcome of a tuning job; null for a success.
 * @param {Job} job
 */
export function tuningWords({ state, progress, problem }) {
  if (state === "succeeded") return null;
  if (state === "cancelled") return "Aborted: the gains are as before.";
  if (state === "failed") return `${sentence(problem?.detail)} The gains are as before.`;
  if (state === "cancelling") return "being aborted";
  if (!progress?.total) return "begins";
  const { done, total, note, eta_s } = progress;
  return [`${done} of ${total} ${note || "steps"}`, timeLeft(eta_s)].filter(Boolean).join(", ");
}

/**
 * Return the rows of the table of a tuning: axis, settling before and after, overshoots, ultimate gain, period.
 * @param {LoopTuneDocument} tuned
 */
export function tuningRows({ steps, relays }) {
  return relays.map(({ axis, ultimate_gain, period_looks }) => {
    const step = steps.find((each) => each.axis === axis);
    return [
      AXIS_NAMES[axis] ?? axis,
      step ? settleText(step.settle_before_ms) : MISSING,
      step ? settleText(step.settle_ms) : MISSING,
      step ? `${number(100 * step.overshoot_before, 0)} %` : MISSING,
      step ? `${number(100 * step.overshoot, 0)} %` : MISSING,
      number(ultimate_gain, 2),
      `${number(period_looks, 1)} looks`,
    ];
  });
}

/** @param {number | null} settle_ms */
function settleText(settle_ms) {
  return settle_ms === null ? "not settled" : `${number(settle_ms, 0)} ms`;
}

/**
 * Return the message of an event; null for an event that needs none.
 * @param {EventDocument} event
 * @returns {Message | null}
 */
export function eventMessage({ kind, level, message }) {
  if (kind === "loop.tuned") return { tone: "good", title: "The loop is tuned", detail: sentence(message) };
  if (level === "info") return null;
  if (kind === "loop.latched") return { tone: "warn", title: "The vergence loop waits", detail: sentence(message) };
  return kind === "loop.ended" ? { tone: "warn", title: "The vergence loop ended", detail: sentence(message) } : null;
}
