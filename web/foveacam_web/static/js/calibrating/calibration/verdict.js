// Words the health of the calibration in use, for every place that shows it. Pure functions.

import { MISSING, number, sentence, span } from "../../elements/format.js";

/**
 * @import { HealthDocument } from "#api"
 * @import { ConsoleState } from "#page"
 */

const OLD_S = 30 * 86400;

/**
 * Word the state of the calibration in use, with its tone and the reason.
 * @param {Pick<ConsoleState, "rig" | "health">} state
 * @returns {{tone: "good" | "warn" | "plain", text: string, reason: string}}
 */
export function verdictOf({ rig, health }) {
  const calibration = rig?.calibration;
  if (!calibration)
    return {
      tone: "warn",
      text: "Not calibrated",
      reason: rig?.calibration_problem ?? "Without a calibration no pixel can be fixated.",
    };
  const age = span(calibration.age_s);
  const named = `“${calibration.label || calibration.origin}”, ${age} old.`;
  if (health?.verdict === "good")
    return { tone: "good", text: `Calibration good · ${age}`, reason: `${named} ${healthReason(health)}` };
  if (health?.verdict === "recalibrate")
    return { tone: "warn", text: `Recalibrate · ${age}`, reason: `${named} ${healthReason(health)}` };
  const old = calibration.age_s > OLD_S;
  return {
    tone: old ? "warn" : "plain",
    text: `Calibrated ${age} ago`,
    reason: `${named} ${health ? healthReason(health) : "Its health shows in the residuals of the next fixations."}`,
  };
}

/** @param {HealthDocument} health */
export function healthReason({ detail, fixations, score }) {
  const figures =
    score === null
      ? ""
      : ` (score ${number(score, 2)} from ${fixations} ${fixations === 1 ? "fixation" : "fixations"})`;
  return sentence(`${detail.replace(/\.$/, "")}${figures}`) || MISSING;
}

/** @param {HealthDocument | null} health */
export function healthWord(health) {
  if (health?.verdict === "good") return "good";
  return health?.verdict === "recalibrate" ? "recalibrate" : "not known yet";
}
