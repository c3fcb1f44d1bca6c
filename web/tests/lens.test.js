import assert from "node:assert/strict";
import { test } from "node:test";
import { parameterRows } from "../foveacam_web/static/js/calibrating/calibration/lens/words.js";

/** @param {string} name @param {number} value @param {number} sigma @param {boolean} [assumed] */
const parameter = (name, value, sigma, assumed = false) => ({ name, value, sigma, assumed });

test("a parameter is rounded to the second digit of its error, with what it is known from", () => {
  assert.deepEqual(
    parameterRows([
      parameter("fx_px", 28758.93, 2.13),
      parameter("cx_px", 719.52, 71.2, true),
      parameter("k1", -0.00638, 0.0033),
    ]),
    [
      { name: "Focal length, x", value: "28758.9 ± 2.1 px", from: "views" },
      { name: "Centre, x", value: "720 ± 71 px", from: "assumed" },
      { name: "k1", value: "−0.0064 ± 0.0033", from: "views" },
    ],
  );
});

test("coefficients that are assumed to be 0 share a row", () => {
  const rows = parameterRows(["k2", "p1", "p2", "k3"].map((name) => parameter(name, 0, 1e-6, true)));
  assert.deepEqual(rows, [{ name: "k2, p1, p2, k3", value: "0", from: "assumed" }]);
});
