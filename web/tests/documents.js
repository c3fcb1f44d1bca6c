// Documents of the server for the tests, and a way to give only the fields that matter to one.

/**
 * Take some fields of a document for the whole.
 * @param {object} fields
 * @returns {any} any: each test gives only what it is about
 */
export function only(fields) {
  return fields;
}

/** @typedef {import("#api").AlternativeDocument} AlternativeDocument */

/** @type {AlternativeDocument} */
export const NEAR = {
  basis: "both_foveae",
  distance_m: 1.937,
  distance_sigma_m: 0.004,
  point_rig_m: [0.1, 0.1, 1.93],
  probability: 0.62,
};
/** @type {AlternativeDocument} */
export const FAR = {
  basis: "fovea_and_wide",
  distance_m: 2.729,
  distance_sigma_m: 0.02,
  point_rig_m: [0.15, 0.1, 2.72],
  probability: 0.38,
};

/**
 * @param {Partial<import("#api").FixationDocument>} fields
 * @returns {import("#api").FixationDocument}
 */
export function fixation(fields) {
  return only({
    state: "lost",
    reason: "why it is so.",
    distance_m: null,
    distance_sigma_m: null,
    basis: null,
    bound: null,
    alternatives: [],
    chosen_alternative: null,
    left_view: null,
    right_view: null,
    ...fields,
  });
}

/**
 * @param {string} detail
 * @returns {import("#api").Problem}
 */
export function problem(detail) {
  return { type: "/problems/test", title: "Refused", status: 422, detail };
}

/** A wide lens with a mild distortion. @type {import("#api").WideLensDocument} */
export const LENS = {
  width: 1440,
  height: 1080,
  fx_px: 3160,
  fy_px: 3158,
  cx_px: 722.5,
  cy_px: 538.25,
  distortion: [-0.08, 0.12, 0.0004, -0.0003, 0.01],
};
