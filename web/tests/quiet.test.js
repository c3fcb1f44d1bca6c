import assert from "node:assert/strict";
import { test } from "node:test";
import { RequestError } from "../foveacam_web/static/js/transport/api.js";
import { QuietReads } from "../foveacam_web/static/js/transport/quiet.js";

const failure = new RequestError({
  type: "/problems/unreachable",
  title: "no answer",
  status: 0,
  detail: "",
  instance: "",
});

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
