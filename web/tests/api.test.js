import assert from "node:assert/strict";
import { test } from "node:test";

import { outcome, request, RequestError } from "../foveacam_web/static/js/transport/api.js";

test("a body that comes too late is a failed request with a remedy", async (t) => {
  const body = new ReadableStream({
    start: (controller) => controller.error(new DOMException("signal timed out", "TimeoutError")),
  });
  t.mock.method(globalThis, "fetch", () => Promise.resolve(new Response(body)));
  await assert.rejects(request("GET", "/jobs"), (error) => {
    assert.ok(error instanceof RequestError);
    assert.equal(error.document.detail, "GET /jobs got no answer in time.");
    assert.match(error.document.remedy ?? "", /reconnects/);
    return true;
  });
});

test("the outcome of a request is its answer or its error, and an error of the page is thrown", async () => {
  const refused = new RequestError({ type: "/problems/busy", title: "Busy", status: 409, detail: "in use" });
  assert.deepEqual(await outcome(Promise.resolve(7)), { answer: 7, error: null });
  assert.deepEqual(await outcome(Promise.reject(refused)), { answer: null, error: refused });
  await assert.rejects(outcome(Promise.reject(new TypeError("a mistake"))), TypeError);
});
