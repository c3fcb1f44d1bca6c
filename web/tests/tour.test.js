import assert from "node:assert/strict";
import { test } from "node:test";
import { guideAt, LAST, showsDataset, stepAfter, STEPS } from "../foveacam_web/static/js/panels/tour_steps.js";

/** @param {string} kind */
const event = (kind) => /** @type {import("#api").EventDocument} */ ({ kind });

test("each step of the tour is done by what the person does, in their order", () => {
  assert.equal(STEPS.length, 5);
  const done = [
    event("fixation.done"),
    event("wide_depth.changed"),
    event("wide_depth.surveyed"),
    event("measurement.created"),
    event("capture.ended"),
  ];
  assert.equal(stepAfter(0, done), LAST);
  assert.equal(stepAfter(0, done.slice(0, 2)), 1);
  assert.equal(stepAfter(0, done.slice(3)), 0); // a later step's event ends no earlier one
  assert.equal(stepAfter(LAST, done), LAST);
});

test("the last step is done when a dataset is open", () => {
  assert.equal(showsDataset({ tab: "datasets", id: "cap-1", part: null }), true);
  assert.equal(showsDataset({ tab: "datasets", id: null, part: null }), false);
  assert.equal(showsDataset({ tab: "stills", id: "still-1", part: null }), false);
  assert.equal(showsDataset(null), false);
});

test("help opens the guide's page about where one is", () => {
  const found = [
    "#/",
    "#/capture",
    "#/gallery/datasets/x",
    "#/calibration/wide",
    "#/rig/mirrors",
    "#/rigs",
    "#/planner?a",
  ];
  assert.deepEqual(found.map(guideAt), [
    "looking",
    "capturing",
    "capturing",
    "calibrating",
    "devices",
    "operating",
    "studying",
  ]);
});
