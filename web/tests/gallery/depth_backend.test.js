import assert from "node:assert/strict";
import test from "node:test";

import { backendWords, choiceWords, computedBy } from "../../foveacam_web/static/js/video/depth_words.js";

const network = /** @type {const} */ ({
  name: "raft",
  kind: "network",
  licence: "MIT",
  research_only: false,
  sha256: "0",
  problem: null,
});

test("a network says its licence, and whether it is for research or cannot be used", () => {
  assert.equal(backendWords({ ...network, kind: "built_in", name: "sgbm" }), "Semi-global matching");
  assert.equal(backendWords(network), "raft (MIT)");
  assert.equal(backendWords({ ...network, research_only: true }), "raft (research only, MIT)");
  assert.equal(backendWords({ ...network, problem: "no card" }), "raft (cannot be used)");
});

test("a result says what computed it, a network by the hash of its graph", () => {
  assert.equal(computedBy("sgbm", null), "Semi-global matching");
  assert.equal(computedBy("foveal", "7609cef51483d365edca"), "foveal, SHA-256 7609cef51483…");
});

test("the list says why the last look did without the network in use", () => {
  assert.match(choiceWords({ in_use: "raft", fallback: null, backends: [] }), /from the next one on/);
  assert.equal(
    choiceWords({ in_use: "raft", fallback: "out of memory", backends: [] }),
    "The last look was computed by sgbm instead of raft: out of memory",
  );
});
