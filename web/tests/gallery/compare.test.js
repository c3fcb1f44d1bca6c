import assert from "node:assert/strict";
import { test } from "node:test";
import * as words from "../../foveacam_web/static/js/looking/compare/words.js";

/** @param {string} name @param {Partial<import("#api").DepthBackendDocument>} [more] */
function backend(name, more = {}) {
  return {
    name,
    kind: /** @type {"built_in" | "network"} */ ("built_in"),
    licence: "own",
    research_only: false,
    sha256: null,
    problem: null,
    ...more,
  };
}

test("what is in use is compared with a network that can be used, else with another built-in one", () => {
  const backends = [backend("sgbm"), backend("live")];
  const found = { in_use: "sgbm", fallback: null, backends };
  assert.deepEqual(words.firstPair(found), { first: "sgbm", second: "live" });
  const broken = backend("bad", { kind: "network", problem: "no graph" });
  const ours = backend("ours", { kind: "network" });
  assert.deepEqual(words.firstPair({ ...found, backends: [...backends, broken, ours] }), {
    first: "sgbm",
    second: "ours",
  });
});

test("research has to be confirmed for those alone that are chosen", () => {
  const found = {
    in_use: "sgbm",
    fallback: null,
    backends: [backend("sgbm"), backend("big", { research_only: true })],
  };
  assert.deepEqual(words.researchOnly(found, ["sgbm", "live"]), []);
  assert.deepEqual(words.researchOnly(found, ["sgbm", "big"]), ["big"]);
});

test("figures say what they would be, and what is unknown", () => {
  const side = { name: "a", sha256: null, known: 0.954, compute_ms: 12.4, sigma_median_px: null, picture_url: "" };
  assert.deepEqual(words.sideRows(side), [
    ["Depth known", "95 % of the picture"],
    ["Its error, median", "–"],
    ["Time", "12 ms"],
    ["Graph, SHA-256", "built in"],
  ]);
  const found = /** @type {import("#api").BackendComparisonDocument} */ ({
    known_both: 0.5,
    median_px: -0.25,
    spread_px: 0.5,
    within_1: 0.7,
    within_2: null,
  });
  assert.deepEqual(
    words.differenceRows(found).map(([, text]) => text),
    ["50 %", "−0.250 px", "0.500 px", "70 % (68 % if stated rightly)", "–"],
  );
});

test("the expected curve has the area of the histogram", () => {
  const edges = Array.from({ length: 41 }, (_, index) => -5 + index / 4);
  const found = /** @type {import("#api").BackendComparisonDocument} */ ({
    edges,
    shares: edges.slice(1).map(() => 1 / 40),
  });
  const { measured, expected } = words.histogramCurves(found);
  const area = (/** @type {{y: number}[]} */ points) => points.reduce((sum, { y }) => sum + y, 0);
  assert.ok(Math.abs(area(expected) - 1) < 1e-3);
  assert.ok(Math.abs(area(measured) - 1) < 1e-9);
  assert.equal(measured[0]?.x, -4.875);
});
