import assert from "node:assert/strict";
import { test } from "node:test";
import { API, parsed, ROOT, rootOf } from "../foveacam_web/static/js/root.js";

test("the root is what stands before /static/ in a module's address", () => {
  assert.equal(rootOf("http://127.0.0.1:8000/static/v-1/js/root.js"), "");
  assert.equal(rootOf("https://lab.example/foveacam/static/v-1/js/root.js"), "/foveacam");
  assert.equal(rootOf("https://lab.example/my/static/rig/static/js/root.js"), "/my/static/rig");
  assert.equal(rootOf("https://lab.example/elsewhere.js"), "");
  assert.deepEqual([ROOT, API], ["", "/api/v1"]);
});

test("addresses in an answer get the root, other texts do not", () => {
  const text = JSON.stringify({
    url: "/api/v1/stills/1",
    items: [{ glb_url: "/api/v1/clouds/1.glb", ply_url: null, label: "/api/v1", curl: "/x" }],
    provider_url: "https://elsewhere/",
    other_url: "//elsewhere/",
  });
  assert.deepEqual(parsed(text, "/foveacam"), {
    url: "/foveacam/api/v1/stills/1",
    items: [{ glb_url: "/foveacam/api/v1/clouds/1.glb", ply_url: null, label: "/api/v1", curl: "/x" }],
    provider_url: "https://elsewhere/",
    other_url: "//elsewhere/",
  });
  assert.deepEqual(parsed(text), JSON.parse(text));
});
