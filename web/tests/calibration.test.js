import assert from "node:assert/strict";
import { test } from "node:test";
import { facts, parts, sentenceNames, sentences } from "../foveacam_web/static/js/calibrating/calibration/facts.js";
import { knockWords } from "../foveacam_web/static/js/calibrating/calibration/fit/knocks.js";
import { healthReason, healthWord, verdictOf } from "../foveacam_web/static/js/calibrating/calibration/verdict.js";
import { only } from "./documents.js";

/** @param {Partial<import("#api").HealthDocument>} fields */
const health = (fields) =>
  /** @type {import("#api").HealthDocument} */ ({
    score: 0.93,
    fixations: 12,
    detail: "the rows of both eyes agree",
    ...fields,
  });

/** @param {number} age_s */
const rig = (age_s) =>
  /** @type {import("#api").RigDocument} */ (
    only({ calibration: only({ label: "Bench, spring", origin: "sweep", age_s }) })
  );

test("the badge of a good calibration names its age and the reason", () => {
  const verdict = verdictOf({ rig: rig(3 * 3600), health: health({ verdict: "good" }) });
  assert.deepEqual(verdict, {
    tone: "good",
    text: "Calibration good · 3 h",
    reason: "“Bench, spring”, 3 h old. The rows of both eyes agree (score 0.93 from 12 fixations).",
  });
});

test("the badge warns of a calibration that is bad, missing, or old and unknown", () => {
  const bad = verdictOf({ rig: rig(3 * 3600), health: health({ verdict: "recalibrate", detail: "2.4 px apart." }) });
  assert.equal(bad.text, "Recalibrate · 3 h");
  assert.match(bad.reason, /2\.4 px apart \(score/);
  assert.equal(verdictOf({ rig: null, health: null }).text, "Not calibrated");
  assert.equal(verdictOf({ rig: rig(3600), health: null }).tone, "plain");
  assert.equal(verdictOf({ rig: rig(40 * 86400), health: null }).tone, "warn");
});

test("health without a score is its detail alone", () => {
  assert.equal(healthReason(health({ score: null, detail: "too few fixations" })), "Too few fixations.");
  assert.equal(
    healthReason(health({ score: 1, fixations: 1 })),
    "The rows of both eyes agree (score 1.00 from 1 fixation).",
  );
  assert.deepEqual(
    [healthWord(null), healthWord(health({ verdict: "unknown" })), healthWord(health({ verdict: "good" }))],
    ["not known yet", "not known yet", "good"],
  );
});

test("figures are read by the units in their names", () => {
  const rows = facts({
    loo_deg: [0.00123, 0.002],
    tape_m: 2.5,
    parallax_mm: 1.5,
    small_m: 0.0042,
    poses: 81,
    corrected: true,
    picture_url: "/x",
    nothing: null,
    wide_px: { rms: 3.21, max: 9.5 },
  });
  assert.deepEqual(rows, [
    ["Error on poses left out", "0.0012°, 0.0020°"],
    ["Distance by tape", "2.5000 m"],
    ["Parallax", "1.50 mm"],
    ["Small", "4.20 mm"],
    ["Poses", "81"],
    ["Taken out", "yes"],
    ["Wide picture differs by", "rms 3.210 px, max 9.500 px"],
  ]);
});

test("sentences and documents inside a document are told from its figures", () => {
  const document = { note: "the parallax was taken out", eye: "left", near: { rms_deg: 0.1 } };
  assert.deepEqual(sentences(document), ["the parallax was taken out"]);
  assert.deepEqual(sentenceNames(document), ["note"]);
  assert.deepEqual(parts(document), [["near", { rms_deg: 0.1 }]]);
});

test("a knock of the rig during the sweeps is reported", () => {
  const eye = { pieces: 1, px_per_minute: 0, moved_px: 0, sigma_px: 0, minutes: 1, visits: 1 };
  assert.equal(
    knockWords({ left: { ...eye, knocks_px: [4.123, 2] }, right: { ...eye, knocks_px: [] } }),
    "The rig was knocked during the sweeps: the left eye’s gaze jumped by 4.12 px, then by 2.00 px. " +
      "This was corrected; the check shows whether that worked.",
  );
  assert.equal(knockWords(null), "");
});
