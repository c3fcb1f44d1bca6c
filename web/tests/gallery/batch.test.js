import assert from "node:assert/strict";
import { test } from "node:test";
import {
  placesOf,
  progressWords,
  resultWords,
  tickedWords,
} from "../../foveacam_web/static/js/capturing/gallery/batch_words.js";

test("how many datasets are ticked, or what ticks are for", () => {
  assert.equal(tickedWords(0), "Tick datasets to make something of them together.");
  assert.equal(tickedWords(1), "1 dataset ticked");
  assert.equal(tickedWords(12), "12 datasets ticked");
});

test("the workers of a cluster come first where the server has one", () => {
  assert.deepEqual(placesOf(null), [["here", "the server"]]);
  const [first] = placesOf("tcp://lab:8786");
  assert.deepEqual(first, ["cluster", "the cluster tcp://lab:8786"]);
});

test("progress tells how far it is and what was reused", () => {
  assert.equal(progressWords({ done: 0, total: 0, eta_s: null, note: "" }), "Batch: reading the datasets");
  assert.match(progressWords({ done: 3, total: 9, eta_s: 60, note: "2 reused" }), /^Batch: 3 of 9 · 2 reused · /);
});

test("a result names the first failure with its reason", () => {
  const batch = { kind: /** @type {const} */ ("depth"), planned: 4, done: 4, failed: [] };
  assert.equal(resultWords(batch), "The last batch (depth): 4 of 4 made.");
  const failed = [{ dataset: "noise", unit: null, reason: "it has no calibration" }];
  assert.match(resultWords({ ...batch, done: 3, failed }), /3 of 4 made, 1 failed: noise: it has no calibration\.$/);
});
