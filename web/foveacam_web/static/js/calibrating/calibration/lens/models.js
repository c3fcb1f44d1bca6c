// Compares both models of the wide lens: fit error, field of view, accuracy of a pixel's direction.

import { html } from "../../../elements/dom.js";
import { MISSING, number, pixels, sentence } from "../../../elements/format.js";
import { nothing } from "../../../elements/parts.js";

/** @import { WideFitDocument, WideStageDocument } from "#api" */

const NAMES = Object.freeze(
  /** @type {Record<string, string>} */ ({ five: "Five coefficients", rational: "Rational" }),
);

/** @type {[string, (fit: WideFitDocument) => string][]} */
const ROWS = [
  ["RMS", ({ rms_px }) => pixels(rms_px)],
  ["Pixel ↔ angle", ({ accuracy_deg }) => (accuracy_deg === null ? MISSING : `± ${number(accuracy_deg, 4)}°`)],
  ["Image with directions", ({ known_fraction }) => `${number(100 * (known_fraction ?? 1), 0)} %`],
  ["Field of view", ({ fov_x_deg, fov_y_deg }) => `${number(fov_x_deg, 2)}° × ${number(fov_y_deg, 2)}°`],
  ["Focal length", ({ fx_px, fy_px }) => `${number(fx_px, 1)}, ${number(fy_px, 1)} px`],
  ["Principal point", ({ cx_px, cy_px }) => `${number(cx_px, 1)}, ${number(cy_px, 1)} px`],
  ["Distortion", ({ distortion }) => distortion.map((each) => number(each, 4)).join("  ")],
];

/** @param {WideStageDocument | null} wide */
export function lensTable(wide) {
  if (!wide?.fit)
    return [
      nothing(
        sentence(wide?.reason) || "Not fitted yet: that takes views from all over the picture, some of them tilted.",
      ),
    ];
  const fits = wide.other_model ? [wide.fit, wide.other_model] : [wide.fit];
  return [
    html`<table class="compare">
      <thead>
        <tr>
          <td></td>
          ${fits.map(
            (fit, index) =>
              html`<th scope="col">
              ${NAMES[fit.model] ?? fit.model}
              ${index === 0 && html`<span class="badge good">in use</span>`}
            </th>`,
          )}
        </tr>
      </thead>
      <tbody>
        ${ROWS.map(
          ([name, of]) =>
            html`<tr>
            <th scope="row">${name}</th>
            ${fits.map((fit) => html`<td class=${name === "Distortion" ? "long" : ""}>${of(fit)}</td>`)}
          </tr>`,
        )}
      </tbody>
    </table>`,
    wide.reason ? html`<p class="lead">${sentence(wide.reason)}</p>` : null,
  ];
}
