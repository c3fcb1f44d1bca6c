// Formats numbers, ages and states for the operator. Pure functions.

/** @import { FixationState } from "#page" */

export const MISSING = "–";
const MINUS = "−";

/**
 * Format a number with this many decimals and a real minus sign.
 * @param {number | null | undefined} value
 * @param {number} decimals
 */
export function number(value, decimals) {
  if (value === null || value === undefined || !Number.isFinite(value)) return MISSING;
  const digits = value.toFixed(decimals);
  return Number(digits) === 0 ? digits.replace("-", "") : digits.replace("-", MINUS);
}

/**
 * Format a value and its standard error, both rounded to the second digit of the error.
 * @param {number | null | undefined} value_m
 * @param {number | null | undefined} sigma_m
 * @returns {{value: string, sigma: string, unit: string}}
 */
export function distance(value_m, sigma_m) {
  if (value_m === null || value_m === undefined) return { value: MISSING, sigma: "", unit: "" };
  if (!sigma_m || !Number.isFinite(sigma_m)) return { value: number(value_m, 3), sigma: "", unit: "m" };
  const decimals = Math.min(5, Math.max(0, 1 - Math.floor(Math.log10(sigma_m))));
  return { value: number(value_m, decimals), sigma: number(sigma_m, decimals), unit: "m" };
}

/** @param {number | null | undefined} value_m @param {number | null | undefined} sigma_m */
export function distanceText(value_m, sigma_m) {
  const { value, sigma, unit } = distance(value_m, sigma_m);
  return [value, sigma && `± ${sigma}`, unit].filter(Boolean).join(" ");
}

/**
 * Format an angle in degrees, always with its sign, so that columns line up.
 * @param {number | null | undefined} value_deg
 * @param {number} [decimals]
 */
export function angle(value_deg, decimals = 2) {
  if (value_deg === null || value_deg === undefined || !Number.isFinite(value_deg)) return MISSING;
  const digits = number(value_deg, decimals);
  return `${digits.startsWith(MINUS) ? "" : "+"}${digits}°`;
}

/** Format a duration in the largest suitable unit. @param {number | null | undefined} seconds */
export function span(seconds) {
  if (seconds === null || seconds === undefined || !Number.isFinite(seconds)) return MISSING;
  if (seconds < 10) return `${Math.max(0, seconds).toFixed(1)} s`;
  if (seconds < 90) return `${Math.round(seconds)} s`;
  if (seconds < 5400) return `${Math.round(seconds / 60)} min`;
  if (seconds < 129600) return `${Math.round(seconds / 3600)} h`;
  return `${Math.round(seconds / 86400)} days`;
}

/** Word the time left, rounded up to what is known. @param {number | null | undefined} eta_s */
export function timeLeft(eta_s) {
  if (eta_s === null || eta_s === undefined) return "";
  if (eta_s < 8) return "a few seconds left";
  return eta_s < 90 ? `${Math.ceil(eta_s / 5) * 5} s left` : `${Math.round(eta_s / 60)} min left`;
}

/** Format milliseconds with about two significant digits. @param {number | null | undefined} milliseconds */
export function millis(milliseconds) {
  if (milliseconds === null || milliseconds === undefined || !Number.isFinite(milliseconds)) return MISSING;
  const size = Math.abs(milliseconds);
  if (size >= 10_000) return span(milliseconds / 1000);
  return `${number(milliseconds, size < 1 ? 2 : size < 10 ? 1 : 0)} ms`;
}

/** Format an error in pixels with two significant digits. @param {number | null | undefined} value_px */
export function pixels(value_px) {
  if (value_px === null || value_px === undefined || !Number.isFinite(value_px)) return MISSING;
  const size = Math.abs(value_px);
  return `${number(value_px, size < 0.01 ? 4 : size < 0.1 ? 3 : 2)} px`;
}

/** @param {number | null} metres */
export function baseline(metres) {
  return metres === null ? MISSING : `${number(metres * 1000, 1)} mm`;
}

/** @param {string | null | undefined} utc */
export function clockTime(utc) {
  const time = utc ? new Date(utc) : null;
  if (!time || Number.isNaN(time.getTime())) return MISSING;
  return time.toLocaleTimeString(undefined, { hour12: false });
}

/** Format a day and a time to the minute, empty where there is none. @param {string | null | undefined} utc */
export function dayTime(utc) {
  const time = utc ? new Date(utc) : null;
  if (!time || Number.isNaN(time.getTime())) return "";
  return time.toLocaleString(undefined, { dateStyle: "medium", timeStyle: "short" });
}

/** @param {number | null | undefined} count */
export function count(count) {
  return count === null || count === undefined ? MISSING : count.toLocaleString("en").replaceAll(",", "\u202f");
}

/** Title, tone and hint for each final state of a fixation. */
export const ENDS = Object.freeze(
  /** @type {Record<FixationState, {title: string, tone: "good" | "warn" | "bad", hint: string}>} */ ({
    verged: { title: "Verged", tone: "good", hint: "" },
    no_texture: {
      title: "No texture here",
      tone: "warn",
      hint: "Nothing in this patch to match between the eyes. Click on an edge or a marking close by, or drag a rectangle around more of it.",
    },
    lost: {
      title: "Lost",
      tone: "warn",
      hint: "The eyes could not agree on the same point. Click again, on something that stands out more.",
    },
    out_of_range: {
      title: "Out of range",
      tone: "warn",
      hint: "The mirrors cannot reach it. Click inside the dashed outline of the steerable field.",
    },
    timed_out: {
      title: "Timed out",
      tone: "warn",
      hint: "The loop did not settle in time. Look again; if it repeats, see the rig's status.",
    },
  }),
);

/**
 * Return the remedy of a problem as a sentence; empty when its detail already contains it.
 * @param {{detail?: string | null, remedy?: string | null} | null | undefined} problem
 */
export function remedyOf(problem) {
  const remedy = problem?.remedy ?? "";
  return problem?.detail?.includes(remedy) ? "" : sentence(remedy);
}

/**
 * Turn a text of the server into a sentence: a capital first, a full stop last.
 * @param {string | null | undefined} text
 */
export function sentence(text) {
  const trimmed = text?.trim() ?? "";
  if (trimmed === "") return "";
  const begun = trimmed.charAt(0).toUpperCase() + trimmed.slice(1);
  return /[.!?…]$/.test(begun) ? begun : `${begun}.`;
}

/** Return a kind of capture with the date and time to the second, the default name of its folder. @param {string} kind */
export function timedName(kind) {
  const now = new Date();
  const two = (/** @type {number} */ value) => String(value).padStart(2, "0");
  const day = [now.getFullYear(), two(now.getMonth() + 1), two(now.getDate())].join("-");
  return `${kind} ${day} ${two(now.getHours())}.${two(now.getMinutes())}.${two(now.getSeconds())}`;
}
