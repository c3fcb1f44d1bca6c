import assert from "node:assert/strict";
import { test } from "node:test";

import { Fixations } from "../foveacam_web/static/js/fixations.js";
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
  t.mock.method(globalThis, "fetch", () => new Promise((resolve) => (answer = resolve)));
  const store = new Store(only({ current: null }));
  const fixations = new Fixations(store);
  const read = fixations.resume();
  fixations.sending(null);
  answer(Response.json([LAST]));
  await read;
  assert.equal(store.state.current?.state, "sending");
});

test("the last fixation is shown where none was ordered meanwhile", async (t) => {
  t.mock.method(globalThis, "fetch", () => Promise.resolve(Response.json([LAST])));
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
  fixations.hear(event("fixation.step", { job_id: "job-2", step: { index: 1 } }));
  assert.equal(store.state.current?.state, "succeeded");
  assert.equal(store.state.current?.steps.length, 2);
  assert.equal(fixations.running, false);
});
