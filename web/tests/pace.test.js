import assert from "node:assert/strict";
import { test } from "node:test";
import { paceOf } from "../foveacam_web/static/js/video/pace.js";
import { only } from "./documents.js";

const SHOWN = { count: 9, fps: 15, frozen: false, silent_ms: 40, watched_ms: 60_000 };
const SERVED = { rate_hz: 15, age_ms: 40, frozen_since_ms: null, expected_hz: 15, slow_reason: null };

/** @param {{shown?: object, served?: object, work?: object | null}} what @param {"wide" | "left"} [name] */
function pace({ shown = {}, served = {}, work = null }, name = "wide") {
  return paceOf(
    only({
      shown: { [name]: { ...SHOWN, ...shown } },
      server_stats: { [name]: { ...SERVED, ...served } },
      work,
      capturing: null,
    }),
    name,
  );
}

test("a view that comes as fast as it should has no trouble", () => {
  assert.equal(pace({}), null);
  assert.equal(pace({ served: { expected_hz: null }, shown: { fps: 0.2 } }), null);
});

test("a slow view says how slow it is and why", () => {
  assert.deepEqual(pace({ served: { rate_hz: 2.1, slow_reason: "the scene is drawn no faster" } }), {
    frozen: false,
    text: "Slow: 2 of 15 fps",
    reason: "the scene is drawn no faster",
  });
});

test("a page that takes fewer pictures than come says that it is the page, once it has had time", () => {
  const found = pace({ shown: { fps: 3 } });
  assert.ok(found && !found.frozen);
  assert.equal(found.text, "Slow: 3 of 15 fps");
  assert.match(found.reason, /this browser/);
  assert.equal(pace({ shown: { fps: 3, watched_ms: 2000 } }), null);
});

test("a view without new pictures is frozen, however slow it was", () => {
  const slow = { rate_hz: 0, slow_reason: "x" };
  assert.deepEqual(pace({ served: { ...slow, frozen_since_ms: 4000 } }), { frozen: true, for_ms: 4000 });
  assert.deepEqual(pace({ served: slow, shown: { silent_ms: 3000 } }), { frozen: true, for_ms: 3000 });
});

test("a view that nobody watches any more, or only just, is not frozen", () => {
  const frozen = { frozen_since_ms: 4000 };
  assert.equal(pace({ served: frozen, shown: { watched_ms: null } }), null);
  assert.equal(pace({ served: frozen, shown: { watched_ms: 1000 } }), null);
  assert.equal(pace({ shown: { silent_ms: 3000, watched_ms: null } }), null);
});

test("the foveae are not slow while a procedure has them", () => {
  const work = { state: "running" };
  assert.equal(pace({ served: { frozen_since_ms: 4000 }, work }, "left"), null);
  assert.deepEqual(pace({ served: { frozen_since_ms: 4000 }, work }), { frozen: true, for_ms: 4000 });
});
