import assert from "node:assert/strict";
import { test } from "node:test";

import { heading } from "../foveacam_web/static/js/looking/answers.js";
import { Fixations } from "../foveacam_web/static/js/looking/fixations.js";
import { Store } from "../foveacam_web/static/js/store.js";
import { only } from "./documents.js";

/** @import { EventDocument, FixationDocument, JobDocument } from "#api" */

const LAST = /** @type {FixationDocument} */ (only({ id: "fix-1", job_id: "job-1", request: null, steps: [] }));

/** @param {string} kind @param {object} data @returns {EventDocument} */
const event = (kind, data) => only({ kind, data });

/** @param {Partial<JobDocument>} more @returns {JobDocument} */
const job = (more) => only({ problem: null, progress: null, result_url: null, ...more });

test("a fixation that was ordered while the last one was read is not replaced by it", async (t) => {
  /** @type {(answer: Response) => void} */
  let answer = () => assert.fail("nothing was asked");
  t.mock.method(globalThis, "fetch", (/** @type {string} */ url) =>
    String(url).endsWith("/estimates") ? Response.json([]) : new Promise((resolve) => (answer = resolve)),
  );
  const store = new Store(only({ current: null }));
  const fixations = new Fixations(store);
  const read = fixations.resume();
  fixations.sending(null);
  answer(Response.json([LAST]));
  await read;
  assert.equal(store.state.current?.state, "sending");
});

test("the last fixation is shown where none was ordered meanwhile", async (t) => {
  t.mock.method(globalThis, "fetch", (/** @type {string} */ url) =>
    Promise.resolve(Response.json(String(url).endsWith("/estimates") ? [] : [LAST])),
  );
  const store = new Store(only({ current: null }));
  await new Fixations(store).resume();
  assert.equal(store.state.current?.fixation?.id, "fix-1");
});

test("a step that is heard after the result does not let the fixation run again", async (t) => {
  const result = { ...LAST, id: "fix-2", job_id: "job-2", steps: [{ index: 0 }, { index: 1 }] };
  t.mock.method(globalThis, "fetch", () => Promise.resolve(Response.json(result)));
  const store = new Store(only({ current: null }));
  const fixations = new Fixations(store);
  fixations.sending(null);
  fixations.follow(job({ id: "job-2", state: "succeeded", result_url: "/api/v1/fixations/fix-2" }), null, true);
  await store.until(["current"], ({ current }) => current?.fixation?.id === "fix-2");
  fixations.onEvent(event("fixation.step", { job_id: "job-2", step: { index: 1 } }));
  assert.equal(store.state.current?.state, "succeeded");
  assert.equal(store.state.current?.steps.length, 2);
  assert.equal(fixations.running, false);
});

test("what is known of a distance so far is shown until the job ends, and not after it", () => {
  const store = new Store(only({ current: null }));
  const fixations = new Fixations(store);
  const estimate = { fixation_id: "fix-3", job_id: "job-3", step: 0, distance_m: 8, distance_sigma_m: 0.6 };
  const request = /** @type {import("#api").FixationRequest} */ (only({ pixel: { x_px: 1, y_px: 2 } }));
  fixations.sending(request);
  fixations.onEvent(event("fixation.estimate", estimate)); // before the answer to the order
  assert.equal(store.state.current?.estimate?.distance_m, 8);
  assert.deepEqual(store.state.current?.request, request);
  fixations.onEvent(event("job.updated", job({ id: "job-3", state: "cancelled" })));
  fixations.onEvent(event("fixation.estimate", { ...estimate, step: 1 }));
  assert.equal(store.state.current?.state, "cancelled");
  assert.equal(store.state.current?.estimate?.step, 0);
});

test("a page that opens in the midst shows the fixation that runs", async (t) => {
  const estimate = { fixation_id: "fix-4", job_id: "job-4", step: 2, distance_m: 3, distance_sigma_m: 0.1 };
  t.mock.timers.enable({ apis: ["setTimeout"] });
  t.mock.method(globalThis, "fetch", (/** @type {string} */ url) =>
    Promise.resolve(Response.json(String(url).endsWith("/estimates") ? [estimate] : [LAST])),
  );
  const store = new Store(only({ current: null }));
  await new Fixations(store).resume();
  assert.equal(store.state.current?.job_id, "job-4");
  assert.equal(store.state.current?.state, "running");
  assert.equal(store.state.current?.estimate?.step, 2);
});

test("a distance that is known to no better than a tenth has a warning above it", () => {
  /** @param {string} basis @param {number} distance_sigma_m */
  const toned = (basis, distance_sigma_m) =>
    heading(only({ basis, distance_m: 2.7, distance_sigma_m, left_view: { sees_target: true }, alternatives: [] }));
  assert.equal(toned("fovea_and_wide", 0.004).tone, "good");
  assert.equal(toned("both_foveae", 0.2).tone, "good");
  const uncertain = toned("fovea_and_wide", 1.7);
  assert.equal(uncertain.tone, "warn");
  assert.match(uncertain.title, /left fovea/);
  assert.match(uncertain.hint, /uncertain/);
  assert.equal(toned("surroundings", 0.4).tone, "warn");
  assert.equal(toned("surroundings", 0.1).tone, "plain");
});
