// Texts of acceptance runs: verdicts, findings, and figures beside their limits. Pure functions.

import { span } from "../../elements/format.js";

/**
 * @import { AcceptanceCheckDocument, AcceptanceDocument, AcceptanceFigureDocument, AcceptanceFindingDocument } from "#api"
 * @import { PanTiltDocument } from "#api"
 * @typedef {{tone: "good" | "warn" | "bad" | "plain", text: string}} Marked
 * @typedef {{name: string, value: string, limits: string, within: boolean}} FigureRow
 */

const NO_STATION = /no station with markers/;
const DIGITS = 6;

/** @type {Readonly<Record<AcceptanceCheckDocument["verdict"], Marked>>} */
export const VERDICTS = Object.freeze({
  passed: { tone: "good", text: "passed" },
  failed: { tone: "bad", text: "failed" },
  not_done: { tone: "plain", text: "not made" },
});

/** Word the verdict of a run, with the reason. @param {AcceptanceDocument} run @returns {Marked & {reason: string}} */
export function verdictOf(run) {
  const { accepted, complete, checks } = run;
  const faults = findingsOf(run).length;
  const missed = checks.filter(({ verdict }) => verdict === "not_done").length;
  const made = checks.length - missed;
  if (accepted) return { tone: "good", text: "Accepted", reason: `All ${checks.length} checks passed.` };
  if (!complete)
    return {
      tone: faults ? "bad" : "warn",
      text: "Ended early",
      reason: `${counted(made, "check")} made until then: ${faults ? `${faultWords(faults)} found.` : "nothing wrong."}`,
    };
  const left = missed ? `${missed} of ${checks.length} checks could not be made.` : "";
  const found = faults ? `${faultWords(faults)} found.` : "Nothing wrong was found, but";
  return { tone: faults ? "bad" : "warn", text: "Not accepted", reason: [found, left].filter(Boolean).join(" ") };
}

/**
 * Return all findings of a run with the title of their check, in the order of the checks.
 * @param {AcceptanceDocument} run
 * @returns {(AcceptanceFindingDocument & {check: string})[]}
 */
export function findingsOf({ checks }) {
  return checks.flatMap(({ title, findings }) => findings.map((found) => ({ ...found, check: title })));
}

/** @param {number} faults */
export function faultWords(faults) {
  return faults === 0 ? "no fault" : counted(faults, "fault");
}

/** @param {AcceptanceFigureDocument} figure @returns {FigureRow} */
export function figureRow({ name, value, unit, low, high, within }) {
  return { name, value: withUnit(amount(value), unit), limits: limitsOf(low, high, unit), within };
}

/**
 * Word the limits of a figure; empty where it has none.
 * @param {number | null} low
 * @param {number | null} high
 * @param {string} unit
 */
function limitsOf(low, high, unit) {
  if (low !== null && high !== null) return withUnit(`${amount(low)} to ${amount(high)}`, unit);
  if (high !== null) return `at most ${withUnit(amount(high), unit)}`;
  return low === null ? "" : `at least ${withUnit(amount(low), unit)}`;
}

/** Format a number with six significant digits and a real minus sign; very small ones as a power of ten. @param {number} value */
function amount(value) {
  const [digits, power] = String(Number(value.toPrecision(DIGITS))).split("e");
  const text = power === undefined ? digits : `${digits} · 10^${Number(power)}`;
  return (text ?? "").replaceAll("-", "−");
}

/** @param {string} text @param {string} unit */
function withUnit(text, unit) {
  return unit.startsWith("°") ? `${text}${unit}` : `${text} ${unit}`.trim();
}

/** Return when a run was made, how long it took, and with what. @param {AcceptanceDocument} run */
export function circumstances({ duration_s, rig_id, calibration_id }) {
  return [
    `took ${span(duration_s)}`,
    `rig ${rig_id}`,
    calibration_id ? `calibration ${calibration_id.slice(0, 10)}` : "no calibration in use",
  ];
}

/** Return whether some checks of a run were not made for want of markers. @param {AcceptanceDocument | undefined} run */
export function lackedMarkers(run) {
  return run?.checks.some(({ note }) => NO_STATION.test(note)) ?? false;
}

/** Return whether the rig's file names no station with markers. @param {PanTiltDocument | null} pan_tilt */
export function hasNoMarkers(pan_tilt) {
  return pan_tilt !== null && !pan_tilt.stations.some(({ target }) => target === "markers");
}

/** Word what moves during a run. @param {PanTiltDocument | null} pan_tilt */
export function motionWords(pan_tilt) {
  const kept = "STOP and Cancel work at any time, and the checks made until then are kept.";
  if (pan_tilt?.present && !pan_tilt.moves_itself)
    return `The mirrors move, and you turn the rig by hand as this page says. ${kept}`;
  return `${pan_tilt?.present ? "The rig and its mirrors" : "The mirrors"} move: keep clear. ${kept}`;
}

/** @param {number} count @param {string} noun */
function counted(count, noun) {
  return `${count} ${noun}${count === 1 ? "" : "s"}`;
}
