import assert from "node:assert/strict";
import { test } from "node:test";
import { withEvent } from "../foveacam_web/static/js/operating/event_log.js";
import * as positioner from "../foveacam_web/static/js/devices/rig/positioner_words.js";
import * as scale from "../foveacam_web/static/js/devices/rig/scale.js";
import * as words from "../foveacam_web/static/js/devices/rig/words.js";
import { only } from "./documents.js";

const EXPOSURE = { low: 0.03, high: 1000 };

test("a logarithmic slider has its middle at the geometric mean", () => {
  assert.equal(scale.valueAt(EXPOSURE, "log", 0.5), 5.48); // sqrt(0.03 · 1000), to three digits
  assert.ok(Math.abs(scale.shareOf(EXPOSURE, "log", Math.sqrt(30)) - 0.5) < 1e-12);
  assert.deepEqual(
    [0, 1].map((share) => scale.valueAt(EXPOSURE, "log", share)),
    [0.03, 1000],
  );
});

test("a slider holds values beyond its ends at its ends", () => {
  assert.deepEqual(
    [-5, 3, 99].map((value) => scale.shareOf({ low: 0, high: 12 }, "linear", value)),
    [0, 0.25, 1],
  );
  assert.equal(scale.shareOf({ low: 4, high: 4 }, "linear", 4), 0);
  assert.equal(scale.shareOf(EXPOSURE, "log", 0), 0);
});

test("spans and values are read with the digits that count", () => {
  assert.equal(scale.spanText(EXPOSURE, "ms"), "0.03 … 1000 ms");
  assert.equal(scale.spanText({ low: -4, high: 0.123456 }, ""), "−4 … 0.1235");
  assert.deepEqual(scale.decades({ low: 0.03, high: 120 }), [0.1, 1, 10, 100]);
});

test("a value that the camera took otherwise is told from one that only reads otherwise", () => {
  assert.equal(scale.snapped(1.234, 1.24), true);
  assert.equal(scale.snapped(1.23401, 1.23399), false);
});

test("the link of a camera says since when and why", () => {
  const lost = /** @type {const} */ ({ phase: "backoff", reason: "no frame for 1 s", since_s: 12, epoch: 2 });
  assert.equal(words.phaseWords(lost).text, "Lost, trying again");
  assert.deepEqual(words.linkWords(lost), { since: "for 12 s", reason: "No frame for 1 s." });
  assert.deepEqual(words.linkWords({ ...lost, reason: "", since_s: null }), {
    since: "",
    reason: "It is opened again by itself; nothing needs to be restarted.",
  });
  assert.equal(words.linkOf(undefined).phase, "closed");
});

test("settings are read with their units", () => {
  assert.equal(words.settingText("exposure_ms", 8.33333), "8.333 ms");
  assert.equal(words.settingText("pixel_format", "Mono8"), "Mono8");
  assert.equal(words.settingText("trigger", "none"), "free running");
});

test("a camera takes settings once it is connected and has told its formats", () => {
  const ready = { connected: true, settings: {}, ranges: { pixel_formats: ["Mono8"] } };
  const takes = (/** @type {object} */ fields) => words.takesOrders(/** @type {any} */ ({ ...ready, ...fields }));
  assert.deepEqual(
    [takes({}), takes({ connected: false }), takes({ ranges: { pixel_formats: [] } })],
    [true, false, false],
  );
  assert.equal(words.takesOrders(undefined), false);
});

test("of what the foveae differ in, the trigger cannot be set here", () => {
  const divergence = /** @type {import("#api").DifferenceDocument[]} */ ([
    { setting: "trigger", left: "none", right: "hardware" },
    { setting: "gain_db", left: 0, right: 6 },
  ]);
  assert.deepEqual(words.settable(only({ divergence })), divergence.slice(1));
  assert.deepEqual(words.settable(null), []);
});

test("the event log keeps 200 events, each once, and none that is shown elsewhere", () => {
  const event = (/** @type {number} */ id, kind = "device.fault") =>
    /** @type {import("#api").EventDocument} */ ({ id, kind });
  /** @type {import("#api").EventDocument[]} */
  let log = [];
  for (let id = 0; id < 250; id++) log = withEvent(log, event(id));
  assert.deepEqual([log.length, log[0]?.id, log.at(-1)?.id], [200, 50, 249]);
  assert.equal(withEvent(log, event(249)), log);
  assert.equal(withEvent(log, event(250, "job.updated")), log);
  for (const kind of ["target.created", "cloud.created", "wide_depth.changed"])
    assert.equal(withEvent(log, event(251, kind)), log); // of a fixation
});

test("a positioner says what is known of its place, and what to do where it is not known", () => {
  const now = { connected: true, moving: false, homed: false, awaits_zero: false };
  const said = (/** @type {Partial<typeof now>} */ changed) => [
    positioner.stateWord({ ...now, ...changed }, "turning"),
    positioner.nextStep({ ...now, ...changed }, "points"),
  ];
  assert.deepEqual(said({}), ["not homed", "Home it first: it is not known where it points."]);
  assert.deepEqual(said({ awaits_zero: true }), [
    "waits for its zero",
    "Bring it to its zero, then confirm that: it is not known where it points.",
  ]);
  assert.deepEqual(said({ homed: true }), ["at rest", ""]);
  assert.deepEqual(said({ moving: true }), ["turning", ""]);
  assert.deepEqual(said({ connected: false }), ["not connected", ""]);
});
