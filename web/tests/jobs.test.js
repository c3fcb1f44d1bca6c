import assert from "node:assert/strict";
import { beforeEach, test } from "node:test";

import { GalleryReader } from "../foveacam_web/static/js/capturing/gallery/reader.js";
import { hasEnded, JobFollower, resultPath } from "../foveacam_web/static/js/transport/jobs.js";
import { only, problem } from "./documents.js";

/** @import { TestContext } from "node:test" */
/** @import { EventDocument, JobDocument } from "#api" */
/** @import { Job } from "#page" */

const LOOK_MS = 700;
const UNKNOWN = { ...problem("there is no such job"), status: 404 };

/** @type {Job[]} what a follower has reported */
let reported = [];
/** @type {string[]} the paths that were read */
let asked = [];
beforeEach(() => ([reported, asked] = [[], []]));

/** @param {JobDocument["state"]} state @param {Partial<JobDocument>} [more] @returns {JobDocument} */
const job = (state, more) => only({ id: "job-1", kind: "still", state, problem: null, result_url: null, ...more });

/** @param {JobDocument} data @returns {EventDocument} */
const event = (data) => only({ kind: "job.updated", data });

/** Let the server answer by path, and timers stand. @param {TestContext} t @param {Record<string, () => unknown>} answers */
function serve(t, answers) {
  t.mock.timers.enable({ apis: ["setTimeout"] });
  t.mock.method(globalThis, "fetch", async (/** @type {string} */ url) => {
    const path = String(url).replace(/^.*\/api\/v1/, "");
    asked.push(path);
    const answer = answers[path]?.() ?? UNKNOWN;
    if (answer instanceof Error) throw answer;
    const { status = 200 } = /** @type {{status?: number}} */ (answer);
    return Response.json(answer, { status });
  });
}

/** Let this time pass, and what was asked be answered. @param {TestContext} t */
async function wait(t, ms = LOOK_MS) {
  t.mock.timers.tick(ms);
  for (let turn = 0; turn < 3; turn += 1) await new Promise(setImmediate);
}

/** @param {Partial<ConstructorParameters<typeof JobFollower>[0]>} [more] */
const following = (more) => new JobFollower({ news: (now) => reported.push(now), ...more });

const states = () => reported.map(({ state }) => state);

test("a job is reported from its queue to its end, with the time left", async (t) => {
  const progress = { done: 2, total: 8, eta_s: 12, note: "matching" };
  serve(t, { "/jobs/job-1": () => job("succeeded", { result_url: "http://rig/api/v1/stills/still-1" }) });
  const jobs = following();
  jobs.follow(job("queued"));
  jobs.onEvent(event(job("running", { progress })));
  assert.deepEqual(states(), ["queued", "running"]);
  assert.equal(jobs.job?.progress?.eta_s, 12);
  assert.equal(resultPath(only({ ...jobs.job })), null);
  await wait(t);
  assert.deepEqual(states(), ["queued", "running", "succeeded"]);
  assert.equal(resultPath(only({ ...jobs.job })), "/stills/still-1");
  assert.equal(jobs.running, false);
  await wait(t, 10 * LOOK_MS);
  assert.deepEqual(asked, ["/jobs/job-1"]);
});

test("a job is read only where its events do not arrive", async (t) => {
  serve(t, { "/jobs/job-1": () => job("running") });
  const jobs = following();
  jobs.follow(job("running"));
  for (let heard = 0; heard < 5; heard += 1) {
    await wait(t, LOOK_MS - 1);
    jobs.onEvent(event(job("running")));
  }
  assert.deepEqual(asked, []);
  await wait(t);
  await wait(t);
  assert.deepEqual(asked, ["/jobs/job-1", "/jobs/job-1"]);
});

test("a cancelled job is reported as such while it ends, and once more when it has", async (t) => {
  serve(t, { "/jobs/job-1": () => job("cancelled") });
  const jobs = following();
  /** @type {string[]} */
  const sent = [];
  const commands = {
    send: async (/** @type {string} */ _, /** @type {string} */ path) => (sent.push(path), only(job("cancelling"))),
  };
  assert.equal(await jobs.cancel(commands), null);
  jobs.follow(job("running"));
  await jobs.cancel(commands);
  await wait(t);
  assert.deepEqual(states(), ["running", "cancelling", "cancelled"]);
  await jobs.cancel(commands);
  assert.deepEqual(sent, ["/jobs/job-1/cancel"]);
});

test("a refused cancel leaves the job as it is", async () => {
  const jobs = following();
  jobs.follow(job("running"));
  assert.equal(await jobs.cancel({ send: async () => null }), null);
  assert.deepEqual(states(), ["running"]);
  jobs.forget();
});

test("a job that failed has its error, and what is heard later does not let it run again", () => {
  const jobs = following();
  jobs.follow(job("running"));
  jobs.onEvent(event(job("failed", { problem: problem("camera left is lost") })));
  jobs.onEvent(event(job("running")));
  jobs.follow(job("queued")); // the answer to the order, which came after the job's events
  assert.deepEqual(states(), ["running", "failed", "failed"]);
  assert.equal(jobs.job?.problem?.detail, "camera left is lost");
});

test("a lost connection and a server that starts again only delay the end", async (t) => {
  const answers = [
    new TypeError("fetch failed"),
    { ...problem("the rig opens"), status: 503 },
    job("failed", { problem: problem("the server has stopped") }),
  ];
  serve(t, { "/jobs/job-1": () => answers.shift() });
  const jobs = following();
  jobs.follow(job("running"));
  await wait(t);
  await wait(t);
  assert.deepEqual(states(), ["running"]);
  await jobs.readAll(); // the connection is there again
  assert.equal(reported.at(-1)?.problem?.detail, "the server has stopped");
  assert.deepEqual(answers, []);
});

test("a job that the server has deleted has failed", async (t) => {
  serve(t, {});
  const jobs = following();
  jobs.follow(job("running"));
  await wait(t);
  assert.deepEqual(reported.at(-1), { id: "job-1", state: "failed", problem: UNKNOWN });
});

test("a page that was left asks no more, and gets no report of what it asked before", async (t) => {
  serve(t, { "/jobs/job-1": () => job("succeeded") });
  const jobs = following();
  jobs.follow(job("running"));
  t.mock.timers.tick(LOOK_MS);
  jobs.forget();
  await wait(t, 10 * LOOK_MS);
  assert.deepEqual(states(), ["running"]);
  assert.deepEqual(asked, ["/jobs/job-1"]);
});

test("a page of the gallery that was left does not follow its job any more", async (t) => {
  serve(t, { "/jobs?limit=20": () => [job("running")] });
  const left = new AbortController();
  const jobs = following({ ours: () => true });
  new GalleryReader().follow(jobs, left.signal);
  await wait(t, 0);
  left.abort();
  await wait(t, 10 * LOOK_MS);
  assert.deepEqual([states(), asked], [["running"], ["/jobs?limit=20"]]);
});

test("a page that opens in the midst finds the job that runs, of its kind alone", async (t) => {
  const others = [job("running", { id: "job-3", kind: "film" }), job("succeeded", { id: "job-2" })];
  serve(t, { "/jobs?limit=20": () => [...others, job("running")] });
  const jobs = following({ ours: ({ kind }) => kind === "still" });
  await jobs.readAll();
  assert.equal(jobs.id, "job-1");
  jobs.onEvent(event(job("succeeded")));
  await jobs.readAll(); // the list may be older than the event
  assert.deepEqual(states(), ["running", "succeeded"]);
});

test("what another page starts is followed when it is heard of, behind what runs already", () => {
  const jobs = following({ ours: ({ kind }) => kind === "still" });
  jobs.onEvent(event(job("running", { id: "job-9", kind: "film" })));
  jobs.onEvent(event(job("succeeded", { id: "job-8" })));
  assert.equal(jobs.id, null);
  jobs.onEvent(event(job("queued")));
  jobs.onEvent(event(job("queued", { id: "job-2" })));
  assert.equal(jobs.id, "job-1");
  jobs.onEvent(event(job("cancelled")));
  jobs.onEvent(event(job("running", { id: "job-2" })));
  assert.deepEqual([jobs.id, jobs.running], ["job-2", true]);
  jobs.forget();
});

test("a job of which only the id is known is read", async (t) => {
  serve(t, { "/jobs/job-1": () => job("running") });
  const jobs = following();
  jobs.expect("job-1");
  assert.equal(jobs.running, true);
  await wait(t);
  assert.deepEqual(states(), ["running"]);
});

test("the answer about a job is dropped where another is followed by then", async (t) => {
  serve(t, { "/jobs/job-1": () => job("failed") });
  const jobs = following();
  jobs.follow(job("running"));
  t.mock.timers.tick(LOOK_MS);
  jobs.follow(job("running", { id: "job-2" }));
  await wait(t, 0);
  assert.deepEqual(
    reported.map(({ id, state }) => [id, state]),
    [
      ["job-1", "running"],
      ["job-2", "running"],
    ],
  );
});

test("only three states end a job", () => {
  const all = /** @type {const} */ (["queued", "running", "cancelling", "cancelled", "failed", "succeeded"]);
  assert.deepEqual(all.filter(hasEnded), ["cancelled", "failed", "succeeded"]);
});
