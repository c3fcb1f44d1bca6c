// Shows the drift checks (Sec. 3.3): each eye's drift, whether it exceeds its error, and its history.

import { absent, changing, h, html } from "../../../elements/dom.js";
import { angle, dayTime, MISSING, number, sentence } from "../../../elements/format.js";
import { badge, numberField, nothing, starter } from "../../../elements/parts.js";
import { fresh } from "../pictures.js";
import { API } from "../../../root.js";
import { waiting } from "../../../elements/waiting.js";

/**
 * @import { DriftCheckDocument, DriftEyeDocument } from "#api"
 * @import { ConsoleState } from "#page"
 * @import { WizardContext } from "../page.js"
 */

const SHOWN = 8;

/** @param {HTMLElement} place @param {WizardContext} context */
export function mountDrift(place, { store, orders }) {
  const distance = numberField("Distance of the target", {
    min: 0.2,
    max: 1000,
    step: "any",
    unit: "m",
    hint: "not known",
  });
  const run = (/** @type {boolean} */ apply) =>
    distance.input.reportValidity() && orders.checkDrift({ distance_m: distance.value(), apply });
  const why = (/** @type {ConsoleState} */ { rig }) =>
    rig && !rig.calibration ? "There is no calibration to check." : null;
  const measure = starter({ label: "Measure", store, act: () => run(false), keys: ["rig"], why });
  const apply = starter({
    label: "Measure and correct",
    store,
    act: () => run(true),
    primary: true,
    keys: ["rig"],
    why,
    silent: true,
  });
  const result = h("div", { class: "drift" });
  const show = changing(result, resultOf);
  store.on(["drift_checks"], ({ drift_checks }) => show(drift_checks));
  place.append(
    h("p", {
      class: "lead",
      text: "One look at any scene with texture, no board needed. The correction is applied only when it is larger than its own error; doing it twice changes nothing.",
    }),
    h("div", { class: "fields" }, distance.element),
    h("p", { class: "actions" }, measure, apply),
    result,
  );
}

/** @param {DriftCheckDocument[] | null} checks */
function resultOf(checks) {
  const last = checks?.[0];
  if (!checks || !last) return [checks ? nothing("Never checked yet.") : waiting("Loading the checks")];
  const trend = h("img", {
    class: "trend",
    src: fresh(`${API}/drift_checks/trend.png`, last.id),
    alt: "Drift of both eyes over time",
    loading: "lazy",
    on: { error: () => (trend.hidden = true) },
  });
  const large = html`<a href=${trend.getAttribute("src") ?? absent} target="_blank" rel="noopener" title="Open at full size">
    ${trend}
  </a>`;
  return [
    html`<h4>Last check, ${dayTime(last.created_utc)}</h4>`,
    outcome(last),
    html`<div class="scroll-x">
      <table class="compare">
        <thead>
          <tr>
            ${["Eye", "", "Across", "Down", "Roll", "Error, 1 σ"].map((text) => html`<th scope="col">${text}</th>`)}
          </tr>
        </thead>
        <tbody>${last.eyes.map(eyeRow)}</tbody>
      </table>
    </div>`,
    html`<p class="lead">${sentence(last.detail)}</p>`,
    !last.vergence_known &&
      html`<p class="remedy">
        Without a known distance a common inward turn of the eyes cannot be distinguished from depth: give the distance
        to correct that too.
      </p>`,
    large,
    checks.length > 1 ? history(checks.slice(1, 1 + SHOWN)) : null,
  ];
}

/** @param {DriftCheckDocument} check */
function outcome({ applied, eyes, new_calibration_id }) {
  if (applied)
    return html`<p>
      ${badge("good", "corrected")} ${new_calibration_id ? `Record ${new_calibration_id.slice(0, 10)} is in use.` : ""}
    </p>`;
  if (eyes.some(({ significant }) => significant))
    return html`<p>${badge("warn", "drifted")} More than its error; not corrected yet.</p>`;
  return html`<p>${badge("good", "no drift")} Nothing beyond its error.</p>`;
}

/** @param {DriftEyeDocument} eye */
function eyeRow({ eye, shift_x_deg, shift_y_deg, rotation_deg, sigma_deg, significant }) {
  return html`<tr>
    <th scope="row" class="eye-${eye}">${eye}</th>
    <td>${badge(significant ? "warn" : "plain", significant ? "drifted" : "within its error")}</td>
    <td>${angle(shift_x_deg, 4)}</td>
    <td>${angle(shift_y_deg, 4)}</td>
    <td>${angle(rotation_deg, 3)}</td>
    <td>${sigma_deg === null ? MISSING : `${number(sigma_deg, 4)}°`}</td>
  </tr>`;
}

/** @param {DriftCheckDocument[]} checks */
function history(checks) {
  return html`<details>
    <summary>Earlier checks</summary>
    <ul class="history">
      ${checks.map(
        (check) =>
          html`<li>
          <time datetime=${check.created_utc}>${dayTime(check.created_utc)}</time>
          <span class="number">
            ${check.eyes
              .map((eye) => `${eye.eye} ${angle(eye.shift_x_deg, 3)} ${angle(eye.shift_y_deg, 3)}`)
              .join("  ")}
          </span>
          ${check.applied && badge("good", "corrected")}
        </li>`,
      )}
    </ul>
  </details>`;
}
