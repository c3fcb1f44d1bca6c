// Shows the calibration in use: name, age, standard errors, and its health with the reason.

import { changing, h, html } from "../dom.js";
import { baseline, MISSING, number, sentence, span } from "../format.js";
import { icon } from "../icons.js";
import { figures } from "./parts.js";
import { verdictOf } from "./verdict.js";

/**
 * @import { ConsoleState } from "#page"
 * @import { Store } from "../store.js"
 */

/**
 * @param {HTMLElement} place
 * @param {Store} store
 */
export function mountInUse(place, store) {
  const show = changing(place, inUse);
  store.on(["rig", "health"], ({ rig, health }) =>
    show({
      verdict: verdictOf({ rig, health }),
      calibration: rig?.calibration ? { ...rig.calibration, age_s: 0 } : null,
      age: span(rig?.calibration?.age_s),
      loading: rig === null,
    }),
  );
}

/**
 * @param {{verdict: ReturnType<typeof verdictOf>, calibration: NonNullable<ConsoleState["rig"]>["calibration"], age: string, loading: boolean}} now
 */
function inUse({ verdict, calibration, age, loading }) {
  if (loading) return [html`<p class="empty">Loading …</p>`];
  const tone = verdict.tone === "plain" ? "" : verdict.tone;
  const title = h(
    "p",
    { class: `state ${tone}` },
    icon(verdict.tone === "good" ? "check" : verdict.tone === "warn" ? "warn" : "info"),
    verdict.text.replace(/ · .*/, ""),
  );
  const reason = h("p", { class: "lead", text: sentence(verdict.reason) });
  if (!calibration)
    return [
      title,
      reason,
      html`<p class="remedy">Calibrate everything, activate a record of this rig, or import one.</p>`,
    ];
  return [
    title,
    reason,
    figures([
      ["Name", calibration.label || MISSING],
      ["Id", calibration.id.slice(0, 16)],
      ["Origin", calibration.origin],
      ["Age", age],
      [
        "Pointing, 1 σ",
        calibration.mirror_sigma_deg === null ? MISSING : `${number(calibration.mirror_sigma_deg, 4)}°`,
      ],
      [
        "Rectification, 1 σ",
        calibration.rectify_sigma_px === null ? MISSING : `${number(calibration.rectify_sigma_px, 2)} px`,
      ],
      ["Baseline", baseline(/** @type {{baseline_m?: number}} */ (calibration).baseline_m ?? null)],
    ]),
  ];
}
