import assert from "node:assert/strict";
import { test } from "node:test";
import {
  circumstances,
  faultWords,
  figureRow,
  findingsOf,
  hasNoMarkers,
  lackedMarkers,
  motionWords,
  verdictOf,
} from "../foveacam_web/static/js/calibrating/acceptance/words.js";
import { only } from "./documents.js";

/**
 * @import { AcceptanceCheckDocument, AcceptanceDocument, AcceptanceFigureDocument } from "#api"
 */

const LATE = { fault: "late_strobe", subject: "left", detail: "the strobe comes late", remedy: "remove its delay" };

/** @param {AcceptanceCheckDocument["verdict"]} verdict @param {object} [more] @returns {AcceptanceCheckDocument} */
const check = (verdict, more) =>
  only({ title: "Trigger and strobe lines", verdict, figures: [], findings: [], note: "", ...more });

/** @param {AcceptanceCheckDocument[]} checks @param {Partial<AcceptanceDocument>} [more] @returns {AcceptanceDocument} */
const run = (checks, more) =>
  only({ complete: true, accepted: checks.every(({ verdict }) => verdict === "passed"), checks, ...more });

/** @param {Partial<AcceptanceFigureDocument>} fields */
const row = (fields) => figureRow(only({ name: "blur", unit: "px", low: null, high: null, within: true, ...fields }));

test("a run is accepted, not accepted or ended early, with the reason", () => {
  const failed = check("failed", { findings: [LATE] });
  assert.deepEqual(verdictOf(run([check("passed"), check("passed")])), {
    tone: "good",
    text: "Accepted",
    reason: "All 2 checks passed.",
  });
  assert.deepEqual(verdictOf(run([failed, check("not_done")])), {
    tone: "bad",
    text: "Not accepted",
    reason: "1 fault found. 1 of 2 checks could not be made.",
  });
  assert.deepEqual(verdictOf(run([check("passed"), check("not_done")])), {
    tone: "warn",
    text: "Not accepted",
    reason: "Nothing wrong was found, but 1 of 2 checks could not be made.",
  });
  const early = { complete: false, accepted: false };
  assert.deepEqual(verdictOf(run([check("passed")], early)), {
    tone: "warn",
    text: "Ended early",
    reason: "1 check made until then: nothing wrong.",
  });
  assert.equal(verdictOf(run([check("passed"), failed], early)).reason, "2 checks made until then: 1 fault found.");
  assert.equal(verdictOf(run([failed], early)).tone, "bad");
});

test("findings are listed with the title of their check", () => {
  const found = findingsOf(run([check("passed"), check("failed", { findings: [LATE, LATE] })]));
  assert.deepEqual(
    found.map(({ detail, check }) => [detail, check]),
    [
      ["the strobe comes late", "Trigger and strobe lines"],
      ["the strobe comes late", "Trigger and strobe lines"],
    ],
  );
  assert.deepEqual([0, 1, 2].map(faultWords), ["no fault", "1 fault", "2 faults"]);
});

test("a figure stands beside its limits, both with the unit", () => {
  assert.deepEqual(row({ value: 4.871, high: 2, within: false }), {
    name: "blur",
    value: "4.871 px",
    limits: "at most 2 px",
    within: false,
  });
  assert.equal(row({ value: 1, low: -200, high: 200, unit: "ppm" }).limits, "−200 to 200 ppm");
  assert.equal(row({ value: 1, low: 0.8, unit: "" }).limits, "at least 0.8");
  assert.equal(row({ value: 37.9 }).limits, "");
});

test("figures keep six digits, a real minus sign and no space before degrees", () => {
  const values = [-0.0800000001, 1e-5, 2.5e-7, 0.123456789].map((value) => row({ value, unit: "" }).value);
  assert.deepEqual(values, ["−0.08", "0.00001", "2.5 · 10^−7", "0.123457"]);
  assert.equal(row({ value: 0.00084, unit: "°/min" }).value, "0.00084°/min");
});

test("a run tells how long it took and with which calibration", () => {
  const found = only({ duration_s: 612.4, rig_id: "sim-rig120", calibration_id: "7d8f74c9c94ff29b" });
  assert.deepEqual(circumstances(found), ["took 10 min", "rig sim-rig120", "calibration 7d8f74c9c9"]);
  assert.equal(circumstances({ ...found, calibration_id: null })[2], "no calibration in use");
});

test("a rig without markers is known from its stations, and from a run's note", () => {
  assert.equal(hasNoMarkers(null), false);
  assert.equal(hasNoMarkers(only({ stations: [{ target: "board" }] })), true);
  assert.equal(hasNoMarkers(only({ stations: [{ target: "board" }, { target: "markers" }] })), false);
  const note = "the rig file names no station with markers; add one";
  assert.equal(lackedMarkers(run([check("passed"), check("not_done", { note })])), true);
  assert.equal(lackedMarkers(run([check("not_done", { note: "waits for: Focus" })])), false);
  assert.equal(lackedMarkers(undefined), false);
});

test("the page says what moves, and that a rig is turned by hand", () => {
  assert.match(motionWords(only({ present: true, moves_itself: true })), /^The rig and its mirrors move: keep clear/);
  assert.match(motionWords(only({ present: true, moves_itself: false })), /you turn the rig by hand/);
  assert.match(motionWords(null), /^The mirrors move: keep clear/);
});
