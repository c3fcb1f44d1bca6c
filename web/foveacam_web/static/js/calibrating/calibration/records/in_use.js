// Shows the calibration in use: name, age, standard errors, and its health with the reason.

import { html } from "../../../elements/dom.js";
import { baseline, MISSING, number, sentence, span } from "../../../elements/format.js";
import { icon } from "../../../elements/icons.js";
import { figures } from "../../../elements/parts.js";
import { verdictOf } from "../verdict.js";
import { waiting } from "../../../elements/waiting.js";

/** @import { ConsoleState } from "#page" */

/** @param {Pick<ConsoleState, "rig" | "health">} state */
export function inUse({ rig, health }) {
  if (rig === null) return waiting("Loading the calibration");
  const { tone, text, reason } = verdictOf({ rig, health });
  const { calibration } = rig;
  const picture = icon(tone === "good" ? "check" : tone === "warn" ? "warn" : "info");
  return [
    html`<p class="state ${tone === "plain" ? "" : tone}">${picture}${text.replace(/ · .*/, "")}</p>`,
    html`<p class="lead">${sentence(reason)}</p>`,
    calibration
      ? figures(rowsOf(calibration))
      : html`<p class="remedy">Calibrate everything, activate a record of this rig, or import one.</p>`,
  ];
}

/** @param {NonNullable<NonNullable<ConsoleState["rig"]>["calibration"]>} calibration @returns {[string, string][]} */
function rowsOf(calibration) {
  const { label, id, origin, age_s, mirror_sigma_deg, rectify_sigma_px } = calibration;
  return [
    ["Name", label || MISSING],
    ["Id", id.slice(0, 16)],
    ["Origin", origin],
    ["Age", span(age_s)],
    ["Pointing, 1 σ", mirror_sigma_deg === null ? MISSING : `${number(mirror_sigma_deg, 4)}°`],
    ["Rectification, 1 σ", rectify_sigma_px === null ? MISSING : `${number(rectify_sigma_px, 2)} px`],
    ["Baseline", baseline(/** @type {{baseline_m?: number}} */ (calibration).baseline_m ?? null)],
  ];
}
