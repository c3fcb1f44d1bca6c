// The parameters of a fovea's lens as rows: value, standard error, and what it is known from. Pure functions.

import { number } from "../../../elements/format.js";

/** @import { LensParameterDocument } from "#api" */

const NAMES = Object.freeze(
  /** @type {Record<string, string>} */ ({
    fx_px: "Focal length, x",
    fy_px: "Focal length, y",
    cx_px: "Centre, x",
    cy_px: "Centre, y",
  }),
);

/**
 * Return a row for each parameter; coefficients that are assumed to be 0 share one.
 * @param {LensParameterDocument[]} parameters
 * @returns {{name: string, value: string, from: string}[]}
 */
export function parameterRows(parameters) {
  const zero = parameters.filter(isZero);
  const rows = parameters
    .filter((each) => !isZero(each))
    .map((each) => ({
      name: NAMES[each.name] ?? each.name,
      value: valueWords(each),
      from: each.assumed ? "assumed" : "views",
    }));
  if (zero.length > 0) rows.push({ name: zero.map(({ name }) => name).join(", "), value: "0", from: "assumed" });
  return rows;
}

/** @param {LensParameterDocument} parameter */
function isZero({ value, assumed }) {
  return assumed && Math.abs(value) < 1e-4;
}

/** @param {LensParameterDocument} parameter */
function valueWords({ name, value, sigma }) {
  const decimals = sigma > 0 ? Math.min(6, Math.max(0, 1 - Math.floor(Math.log10(sigma)))) : 3;
  const unit = name.endsWith("_px") ? " px" : "";
  return `${number(value, decimals)} ± ${number(sigma, decimals)}${unit}`;
}
