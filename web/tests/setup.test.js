import assert from "node:assert/strict";
import { test } from "node:test";
import * as words from "../foveacam_web/static/js/devices/setup/words.js";

const camera = /** @type {const} */ ({ kind: "pylon", name: "0815-0001" });
/** @type {import("#api").RigDraft} */
const draft = {
  rig_id: "lab",
  name: "Lab",
  baseline_mm: 200,
  working_binning: null,
  cameras: { wide: null, left: camera, right: null },
  fovea_trigger: "hardware",
  mirrors: { port: "auto", max_v: 170, bias_v: 90, low_pass_hz: 120, settle_us: 14000, pulse_us: 4000 },
  pan_tilt: null,
  markers: { side_mm: 60, spacing_mm: 100, wide_id: 0, left_id: 1, right_id: 2 },
};
/** @type {import("#api").DraftDocument} */
const setup = {
  draft,
  path: "/data/rigs/lab.toml",
  file_exists: false,
  changed: true,
  simulated: false,
  faults: [
    { field: "cameras.left", message: "claimed twice" },
    { field: "rail", message: "not permitted here" },
  ],
};

test("a value is read and changed by its path, and the rest of the draft stays", () => {
  assert.equal(words.valueAt(draft, "mirrors.max_v"), 170);
  assert.equal(words.valueAt(draft, "pan_tilt.port"), null);
  const changed = words.withValue(draft, "mirrors.max_v", 120);
  assert.equal(changed.mirrors?.max_v, 120);
  assert.deepEqual({ ...changed, mirrors: draft.mirrors }, draft);
  assert.equal(words.withValue(draft, "name", "Mine").name, "Mine");
});

test("a camera changes its role and leaves the one before", () => {
  assert.equal(words.roleIn(draft, camera), "left");
  const moved = words.withRole(draft, camera, "wide");
  assert.deepEqual(moved.cameras, { wide: camera, left: null, right: null });
  assert.deepEqual(words.withRole(moved, camera, null).cameras, { wide: null, left: null, right: null });
});

test("a role may be given every found camera, and keeps one that is not there", () => {
  const other = { kind: "pylon", name: "1", vendor: "Basler", model: "ace", serial: "1", address: "" };
  const found = /** @type {any} */ ({ cameras: [other], ports: [], silent: [] }); // any: what a choice needs
  assert.deepEqual(
    words.cameraChoices(found, camera).map(({ text }) => text),
    ["none", "Basler ace, 1", "Basler (pylon), 0815-0001: not found"],
  );
  assert.deepEqual(words.cameraOf(words.keyOf({ kind: "opencv", name: "/dev/a b" })), {
    kind: "opencv",
    name: "/dev/a b",
  });
  assert.equal(words.cameraOf(""), null);
});

test("a field says what is wrong with it and what the doctor found, with the remedy", () => {
  const advice = /** @type {import("#api").AdviceDocument[]} */ ([
    { field: "cameras.left", name: "camera_left", level: "problem", found: "not there", remedy: "plug it in" },
    { field: "mirrors.port", name: "ftdi_latency", level: "warning", found: "slow", remedy: "" },
  ]);
  assert.deepEqual(words.notesAt("cameras.left", setup, advice), [
    { tone: "bad", text: "Claimed twice." },
    { tone: "bad", text: "Not there. To do: plug it in" },
  ]);
  assert.deepEqual(words.notesAt("mirrors.port", setup, advice), [{ tone: "warn", text: "Slow." }]);
  assert.deepEqual(
    words.otherFaults(setup, new Set(["cameras.left"])).map(({ field }) => field),
    ["rail"],
  );
});

test("the steps of the start stand while it is under way and at what failed", () => {
  const steps = (/** @type {("done" | "failed" | "active")[]} */ ...states) => ({
    steps: states.map((state) => ({ device: "mirrors", state, detail: "", remedy: "", left_s: null })),
  });
  assert.equal(words.startStands(null), false);
  assert.equal(words.startStands(steps("done")), false);
  assert.equal(words.startStands(steps("done", "active")), true);
  assert.equal(words.startStands(steps("failed", "done")), true);
  assert.equal(words.stepName({ device: "left", state: "done", detail: "", remedy: "", left_s: null }), "Left fovea");
});

test("an active step says how far it is, and about how long it still takes", () => {
  /** @param {Partial<import("#api").StartStepDocument>} change */
  const renderer = (change) =>
    words.stepProgress({
      device: "renderer",
      state: "active",
      detail: "14 of 23 kernels",
      remedy: "",
      left_s: null,
      ...change,
    });
  assert.equal(renderer({}), "14 of 23 kernels");
  assert.equal(renderer({ left_s: 18.2 }), "14 of 23 kernels, about 20 s left");
  assert.equal(renderer({ left_s: 3.4 }), "14 of 23 kernels, about 3 s left");
  assert.equal(renderer({ left_s: 0.1 }), "14 of 23 kernels, about 1 s left");
  assert.equal(renderer({ detail: "" }), "");
  assert.equal(renderer({ state: "done", detail: "The server compiled its kernels by itself: read-only" }), "");
});

test("a difference is shown without its file names, line by line", () => {
  assert.deepEqual(words.differenceLines("--- a\n+++ a\n@@ -1 +1 @@\n-x = 1\n+x = 2\n"), [
    { text: "@@ -1 +1 @@", tone: "same" },
    { text: "-x = 1", tone: "removed" },
    { text: "+x = 2", tone: "added" },
  ]);
});
