import assert from "node:assert/strict";
import { test } from "node:test";
import { visibleIn } from "../foveacam_web/static/js/looking/measure/state.js";
import { doubtWords, factsOf, valueText } from "../foveacam_web/static/js/looking/measure/words.js";
import { only } from "./documents.js";

/** @type {import("#api").MeasuredPointDocument} */
const POINT = {
  view: "depth",
  x_px: 1,
  y_px: 2,
  snapped_px: 0,
  at_edge: false,
  fixation_id: "fix-1",
  point_rig_m: [0.1, -0.2, 1.9],
  point_sigma_m: [0.001, 0.001, 0.004],
  distance_m: 1.91,
  distance_sigma_m: 0.004,
};

/** @param {Partial<import("#api").MeasurementDocument>} fields */
const measured = (fields) =>
  /** @type {import("#api").MeasurementDocument} */ ({
    points: [POINT],
    length: null,
    plane: null,
    profile: null,
    ...fields,
  });

test("what was measured is drawn over the foveae's views only while both look where they looked then", () => {
  const views = /** @type {const} */ (["wide", "left", "right", "anaglyph", "difference", "depth"]);
  const drawn_px = Object.fromEntries(views.map((view) => [view, [[1, 2]]]));
  const line = { id: "m-1", fixation_ids: ["fix-1"], drawn_px, gaze: { left_v: [10, 0], right_v: [-10, 0] } };
  const mirrors = (/** @type {number} */ left_x_v) => ({
    left: { x_v: left_x_v, y_v: 0 },
    right: { x_v: -10, y_v: 0 },
  });
  const shown = (/** @type {number} */ left_x_v, fixation_id = "fix-1") => {
    const clouds = [{ fixation_id }];
    const rig = { mirrors: mirrors(left_x_v) };
    const state = only({ settings: { marks: true }, clouds, rig, measurements: [line], hidden_measurements: [] });
    return views.filter((view) => visibleIn(state, view).length > 0);
  };
  assert.deepEqual(shown(10.05), [...views]);
  assert.deepEqual(shown(12), ["wide"]); // the eyes moved on
  assert.deepEqual(shown(10, "fix-2"), ["wide"]); // a newer look
});

test("a point is its distance, with its place and error along each axis", () => {
  assert.equal(valueText(measured({})), "1.9100 ± 0.0040 m");
  assert.deepEqual(factsOf(measured({})), [
    ["X", "0.1000 ± 0.0010 m"],
    ["Y", "−0.2000 ± 0.0010 m"],
    ["Z", "1.9000 ± 0.0040 m"],
  ]);
});

test("a point that was moved, or lies at an edge, says so", () => {
  const facts = factsOf(measured({ points: [{ ...POINT, snapped_px: 3.25, at_edge: true }] }));
  assert.deepEqual(facts.slice(3), [
    ["Moved", "3.3 px to the nearest pixel with depth"],
    ["Beware", "depth jumps here: it may be of either surface"],
  ]);
});

test("a measurement says which of its points is too uncertain to be of use", () => {
  const point = (/** @type {number} */ distance_sigma_m) => only({ distance_m: 2.7, distance_sigma_m });
  const words = (/** @type {number[]} */ ...sigmas_m) => doubtWords(only({ points: sigmas_m.map(point) }));
  assert.equal(words(0.01, 0.26), "");
  assert.match(words(0.28), /^Its distance is uncertain: 2\.\d+ ± 0\.\d+/);
  assert.match(words(1.7, 0.01), /^The first end’s distance is uncertain: 2\.7 ± 1\.7/);
  assert.match(words(0.01, 1.7), /^The second end’s/);
});

test("a length says whether both ends are of one look", () => {
  const length = /** @type {import("#api").LengthDocument} */ ({
    length_m: 0.25,
    length_sigma_m: 0.0012,
    same_look: true,
  });
  const found = measured({ points: [POINT, POINT], length });
  assert.equal(valueText(found), "0.2500 ± 0.0012 m");
  assert.deepEqual([factsOf(found)[0]?.[0], factsOf(found)[3]?.[0]], ["A X", "B X"]);
  assert.equal(factsOf(found).at(-1)?.[1], "one look: what both points share is taken once");
  const two = measured({ points: [POINT, POINT], length: { ...length, same_look: false } });
  assert.equal(factsOf(two).at(-1)?.[1], "two looks: taken as independent");
});

test("a plane is its tilt, a profile its length", () => {
  const plane = /** @type {import("#api").PlaneDocument} */ ({
    normal: [0, 0, -1],
    normal_sigma_deg: 0.05,
    pan_deg: 12.3,
    pan_sigma_deg: 0.04,
    tilt_deg: -1,
    tilt_sigma_deg: 0.05,
    distance_m: 2,
    distance_sigma_m: 0.01,
    residual_rms_m: 0.002,
    expected_rms_m: 0.0021,
    flatness_m: 0.012,
    pixels: 900,
    outlier_fraction: 0.034,
  });
  assert.equal(valueText(measured({ plane })), "pan +12.3°, tilt −1.0° ± 0.05°");
  assert.deepEqual(factsOf(measured({ points: [], plane })).slice(4), [
    ["Flatness", "12 mm (middle 95 %)"],
    ["Residual", "2.00 mm rms, 2.10 mm expected"],
    ["Outliers", "3.4 % of 900 pixels"],
  ]);
  const profile = /** @type {import("#api").ProfileDocument} */ (
    only({
      samples: [only({ along_m: 0 }), only({ along_m: 0.5 })],
      median_z_m: 2,
      shared_sigma_m: 0.01,
      known_fraction: 0.93,
    })
  );
  assert.equal(valueText(measured({ profile })), "0.500 m long");
  assert.deepEqual(factsOf(measured({ points: [], profile })), [
    ["Median Z", "2.000 ± 0.010 m"],
    ["Depth known", "93 % of the line"],
  ]);
});
