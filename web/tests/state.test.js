import assert from "node:assert/strict";
import { mock, test } from "node:test";
import { isRunning, placeOf } from "../foveacam_web/static/js/calibrating/calibration/state.js";
import { isCapturing, shareOf } from "../foveacam_web/static/js/capturing/capture/state.js";
import { Deletions } from "../foveacam_web/static/js/deletions.js";
import { shownOf } from "../foveacam_web/static/js/looking/measure/state.js";
import { only } from "./documents.js";

/**
 * @typedef {import("#page").Work} Work
 * @typedef {import("#page").Capturing} Capturing
 */

test("a procedure runs until its job has ended, and says which step of all it is", () => {
  const work = /** @type {Work} */ (only({ state: "running", step: "all", stage: "mirrors" }));
  assert.deepEqual([isRunning(null), isRunning(work)], [false, true]);
  for (const state of /** @type {const} */ (["cancelled", "failed", "succeeded"]))
    assert.equal(isRunning({ ...work, state }), false);
  assert.equal(placeOf(work), "step 2 of 5");
  assert.equal(placeOf({ ...work, stage: "all" }), null);
  assert.equal(placeOf({ ...work, step: "mirrors" }), null);
});

test("a capture's share is not known before its first point", () => {
  const progress = { phase: "points", done: 3, total: 12 };
  const capturing = /** @type {Capturing} */ (only({ progress, end: null }));
  assert.equal(isCapturing(capturing), true);
  assert.equal(shareOf(capturing), 0.25);
  assert.equal(shareOf(only({ progress: { ...progress, phase: "survey" } })), null);
  assert.equal(shareOf({ progress: null }), null);
});

test("measurements that wait for their deletion are not shown", () => {
  const measurements = /** @type {import("#api").MeasurementDocument[]} */ ([only({ id: "a" }), only({ id: "b" })]);
  assert.deepEqual(
    shownOf({ measurements, hidden_measurements: ["a"] }).map(({ id }) => id),
    ["b"],
  );
  assert.deepEqual(shownOf({ measurements: null, hidden_measurements: [] }), []);
});

test("an entry is deleted when the time to undo is over, and not after an undo", async (context) => {
  context.mock.timers.enable({ apis: ["setTimeout"] });
  Object.assign(globalThis, { window: { addEventListener() {} } });
  const sent = mock.method(globalThis, "fetch", async () => new Response(null, { status: 204 }));
  /** @type {import("../foveacam_web/static/js/elements/toasts.js").Message[]} */
  const messages = [];
  const commands = only({
    notify: (/** @type {any} */ message) => messages.push(message),
    attempt: (/** @type {any} */ act) => act(),
  });
  /** @type {[string[], string | null][]} */
  const changes = [];
  const deletions = new Deletions({ commands, resource: "/targets", changed: (...now) => changes.push(now) });
  deletions.add({ id: "a", label: "Cup" });
  messages[0]?.action?.act();
  context.mock.timers.tick(6000);
  assert.equal(sent.mock.callCount(), 0);
  deletions.add({ id: "b", label: "Book" });
  context.mock.timers.tick(6000);
  for (let turn = 0; turn < 20; turn += 1) await Promise.resolve();
  assert.match(String(sent.mock.calls[0]?.arguments[0]), /\/targets\/b$/);
  assert.deepEqual(changes, [
    [["a"], null],
    [[], null],
    [["b"], null],
    [[], "b"],
  ]);
});
