import assert from "node:assert/strict";
import { test } from "node:test";
import { RequestError } from "../foveacam_web/static/js/transport/api.js";
import { Store } from "../foveacam_web/static/js/store.js";
import { newestFirst, QuietReads } from "../foveacam_web/static/js/transport/quiet.js";
import { only } from "./documents.js";

/** @param {number} status */
const failed = (status) =>
  new RequestError({ type: "/problems/unreachable", title: "no answer", status, detail: "", instance: "" });
const failure = failed(0);

test("what was asked for during a read that fails is read afterwards", async () => {
  const reads = new QuietReads();
  let runs = 0;
  const read = async () => {
    runs += 1;
    if (runs > 1) return;
    void reads.read("list", read); // an event comes while the answer is awaited
    throw failure;
  };
  await reads.read("list", read);
  assert.equal(runs, 2);
});

test("a read runs once more however often it was asked for meanwhile, and errors of the page are thrown", async () => {
  const reads = new QuietReads();
  let runs = 0;
  await reads.read("list", async () => {
    runs += 1;
    if (runs === 1) for (let k = 0; k < 5; k += 1) void reads.read("list", async () => {});
  });
  assert.equal(runs, 2);
  await assert.rejects(
    reads.read("list", async () => {
      throw new TypeError("a fault of the page");
    }),
    TypeError,
  );
  await reads.read("list", async () => void (runs += 1));
  assert.equal(runs, 3);
});

test("what the server can answer later is read again, ever more seldom, and no failure else", async (t) => {
  t.mock.timers.enable({ apis: ["setTimeout"] });
  const reads = new QuietReads();
  const turn = async () => {
    for (let k = 0; k < 5; k += 1) await Promise.resolve();
  };
  let [runs, answers] = [0, [503, 503, 200]];
  const read = async () => {
    const status = answers[runs] ?? 200;
    runs += 1;
    if (status !== 200) throw failed(status);
  };
  await reads.read("list", read);
  for (const [wait_ms, expected] of /** @type {const} */ ([
    [1999, 1],
    [1, 2],
    [3999, 2],
    [1, 3],
    [60_000, 3],
  ])) {
    t.mock.timers.tick(wait_ms);
    await turn();
    assert.equal(runs, expected);
  }
  [runs, answers] = [0, [404]];
  await reads.read("list", read);
  t.mock.timers.tick(60_000);
  await turn();
  assert.equal(runs, 1);
});

test("a document is kept in the page's state, and stays there while the server is away", async (t) => {
  const [older, newer] = [{ created_utc: "2026-03-01" }, { created_utc: "2026-03-02" }];
  const answers = [Promise.resolve(Response.json([older, newer])), Promise.reject(new TypeError("fetch failed"))];
  t.mock.method(globalThis, "fetch", () => answers.shift());
  const store = new Store(only({ targets: null }));
  const reads = new QuietReads();
  for (let read = 0; read < 2; read += 1) await reads.keep(store, "targets", "/targets", newestFirst);
  assert.deepEqual(store.state.targets, [newer, older]);
});

test("a repeated read goes on after each pause until there is none, also where one fails", async (t) => {
  t.mock.timers.enable({ apis: ["setTimeout"] });
  const reads = new QuietReads();
  const pauses = [100, 100, null];
  let runs = 0;
  const read = async () => {
    runs += 1;
    if (runs === 1) throw failure;
  };
  await reads.repeat("rail", read, () => pauses.shift() ?? null);
  for (let turn = 0; turn < 4; turn += 1) {
    t.mock.timers.tick(100);
    await new Promise(setImmediate);
  }
  assert.equal(runs, 3);
});
