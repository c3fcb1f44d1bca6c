import assert from "node:assert/strict";
import { test } from "node:test";

import { request, RequestError } from "../foveacam_web/static/js/transport/api.js";

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
