// Words for captures: sizes, shares, states and results. Pure functions.

import { count, MISSING, number, remedyOf, sentence, span } from "../../elements/format.js";

/** @import { CaptureEnd, Capturing, Estimate } from "#page" */

/** Format a number of bytes with three significant digits. @param {number | null | undefined} bytes */
export function sizeText(bytes) {
  if (bytes === null || bytes === undefined || !Number.isFinite(bytes)) return MISSING;
  const units = ["B", "kB", "MB", "GB", "TB"];
  let size = bytes;
  let unit = 0;
  while (size >= 999.5 && unit < units.length - 1) {
    size /= 1000;
    unit += 1;
  }
  return `${number(size, unit === 0 || size >= 99.5 ? 0 : size >= 9.95 ? 1 : 2)} ${units[unit]}`;
}

/** @param {number | null} share 0 … 1 */
export function percent(share) {
  return share === null ? MISSING : `${number(100 * share, share < 0.1 && share > 0 ? 1 : 0)} %`;
}

/**
 * Format a range of time in the unit that suits its upper end, rounded outwards, such as "12 to 25 s".
 * @param {number} low_s
 * @param {number} high_s
 */
export function spanRange(low_s, high_s) {
  const unit_s = high_s < 90 ? 1 : high_s < 5400 ? 60 : 3600;
  const name = { 1: "s", 60: "min", 3600: "h" }[unit_s];
  if (low_s < SMALL * unit_s && unit_s > 1)
    return `${span(low_s)} to ${rounded(Math.ceil, high_s / unit_s, 1)} ${name}`;
  const fine = high_s < 10 * unit_s ? 1 : 0;
  const low = rounded(Math.floor, low_s / unit_s, low_s < unit_s ? 1 : fine);
  const high = rounded(Math.ceil, high_s / unit_s, fine);
  return low === high ? `${high} ${name}` : `${low} to ${high} ${name}`;
}

/** A lower limit below this share of the upper one's unit has a unit of its own. */
const SMALL = 0.4;

/** @param {(value: number) => number} towards @param {number} value @param {number} decimals */
function rounded(towards, value, decimals) {
  const steps = 10 ** decimals;
  return number(towards(Number((value * steps).toFixed(6))) / steps, decimals); // an error of division rounds nothing
}

/**
 * Word what an estimated time consists of, and what it is from.
 * @param {Omit<Estimate, "plan" | "coverage">} estimate
 */
export function timeWords({ preparing_fixations, preparing_low_s, preparing_high_s, rail_s, hand_moves, ...rest }) {
  const { timed_captures, limit_s } = rest;
  const parts = [];
  if (preparing_fixations > 0)
    parts.push(
      `${spanRange(preparing_low_s, preparing_high_s)} of it for ${preparing_fixations} fixations that measure the distance`,
    );
  if (rail_s > 0) parts.push(`${span(rail_s)} on the rail`);
  if (hand_moves > 0) parts.push(`${hand_moves} × you push the rig, not counted`);
  if (timed_captures > 0)
    parts.push(
      timed_captures === 1 ? "by the times of the last capture" : `by the times of the last ${timed_captures} captures`,
    );
  else parts.push(`a guess before the first capture; settling, exposing and reading out alone take ${span(limit_s)}`);
  return parts.join(", ");
}

const PHASES = Object.freeze({
  survey: "measuring the scene's distance",
  rail: "moving along the rail",
  points: "",
  paused: "",
  closing: "writing the last points",
});

/** @param {Capturing} capturing */
export function stateWords({ state, asked, progress, why }) {
  if (asked === "cancel") return "cancelling";
  if (why) return "waits for you";
  if (state === "paused") return "paused";
  if (asked === "pause") return "pausing after this point";
  if (!progress) return "starting";
  return PHASES[progress.phase];
}

/** Word a capture's progress: points done, time left, rate. @param {Capturing} capturing */
export function farWords({ progress, state }) {
  if (!progress || progress.total === 0) return "";
  const { done, total, left_s, bytes_per_s, written_bytes } = progress;
  const left = left_s === null || state === "paused" ? "" : `${span(left_s)} left`;
  const written = written_bytes > 0 ? `${sizeText(written_bytes)} at ${sizeText(bytes_per_s)}/s` : "";
  return [`${count(done)} of ${count(total)}`, left, written].filter(Boolean).join(", ");
}

/** Word a capture's end: tone, headline, reason, remedy. @param {Capturing & {end: CaptureEnd}} capturing */
export function endWords({ name, end }) {
  const { job, state, why, problem, taken, planned } = end;
  const title = name ? `“${name}”` : "The capture";
  if (state === "complete")
    return {
      tone: "good",
      head: `${title}: complete`,
      why: `${count(taken)} of ${count(planned)} points are on the disk.`,
      remedy: "",
    };
  const cancelled = job === "cancelled";
  const head = `${title}: ${cancelled ? "cancelled" : job === "failed" ? "failed" : (state ?? "ended")}`;
  const reason = sentence(problem && !cancelled ? problem.detail : why || problem?.detail);
  const counted = reason.includes(`${taken} of ${planned}`);
  const kept =
    state === null
      ? "Nothing was taken yet."
      : counted
        ? ""
        : `${count(taken)} of ${count(planned)} points are on the disk, and stay there.`;
  const remedy = cancelled ? "" : remedyOf(problem);
  return { tone: cancelled ? "warn" : "bad", head, why: [reason, kept].filter(Boolean).join(" "), remedy };
}
