import assert from "node:assert/strict";
import { test } from "node:test";
import { Fixations } from "../foveacam_web/static/js/looking/fixations.js";
import { FullResolution, largerLook } from "../foveacam_web/static/js/panels/full_resolution.js";
import { binningWords } from "../foveacam_web/static/js/devices/rig/words.js";
import { Store } from "../foveacam_web/static/js/store.js";
import { ofLook, resolutionWords } from "../foveacam_web/static/js/video/resolution.js";
import { fixation, only } from "./documents.js";

const SENSOR = { width: 1440, height: 1080 };
const FOVEA = { ...SENSOR, px_per_deg: 502.4 };
const BINNING = /** @type {import("#api").RigBinningDocument} */ ({
  working_binning: 2,
  in_force: 2,
  held_by: null,
  problem: null,
  switch_s: 0.1234,
});
const ANSWERED = fixation({
  id: "fix-1",
  cloud_id: "cld-1",
  basis: "both_foveae",
  distance_m: 4,
});
const HALF = {
  id: "cld-1",
  look_width: 720,
  look_height: 540,
  depth_width: 720,
  depth_height: 540,
};
const FULL = {
  id: "cld-2",
  look_width: 1440,
  look_height: 1080,
  depth_width: 1440,
  depth_height: 1080,
};

/** @param {object} [binning] @param {object[]} [clouds] */
const state = (binning = BINNING, clouds = [HALF]) =>
  only({ rig: { binning, cameras: [{ role: "left", ...FOVEA }] }, clouds });

test("the resolution beside a view is that of the camera's own picture", () => {
  assert.deepEqual(resolutionWords(FOVEA, 1), {
    text: "502 px/°",
    meaning: "Every pixel of the sensor: 1440×1080",
  });
  assert.deepEqual(resolutionWords(FOVEA, 2), {
    text: "251 px/°",
    meaning: "2×2 pixels are one: 720×540 of 1440×1080",
  });
  assert.equal(resolutionWords({ width: 1441, height: 1081, px_per_deg: 9 }, 2)?.text, "4.5 px/°");
});

test("without a calibration only the size is shown, and without a size nothing", () => {
  assert.deepEqual(resolutionWords({ ...SENSOR, px_per_deg: null }, 2), {
    text: "720×540",
    meaning: "2×2 pixels are one: 720×540 of 1440×1080. Pixels a degree are not known without a calibration",
  });
  assert.equal(resolutionWords({ width: null, height: null, px_per_deg: 55 }, 1), null);
  assert.equal(resolutionWords(undefined, 1), null);
});

test("a cloud says the size of its look, and of its depth where that is smaller", () => {
  assert.equal(ofLook(HALF), ", of a look at 720×540");
  assert.equal(ofLook({ ...HALF, look_width: 1440, look_height: 1080 }), " at 720×540, of a look at 1440×1080");
  assert.equal(
    ofLook({
      look_width: null,
      look_height: null,
      depth_width: null,
      depth_height: null,
    }),
    "",
  );
});

test("a look at full resolution is offered where it shows more than the cloud that is there", () => {
  assert.deepEqual(largerLook(state(), ANSWERED), SENSOR);
  assert.deepEqual(largerLook(state(BINNING, []), ANSWERED), SENSOR);
  assert.equal(largerLook(state({ ...BINNING, working_binning: 1 }), ANSWERED), null);
  assert.equal(largerLook(state(BINNING, [FULL]), { ...ANSWERED, cloud_id: "cld-2" }), null);
  for (const basis of /** @type {const} */ (["fovea_and_wide", "bound", null]))
    assert.equal(largerLook(state(), { ...ANSWERED, basis }), null);
  assert.equal(largerLook(only({ rig: null, clouds: [] }), ANSWERED), null);
});

test("a look at full resolution is followed until its cloud is there", async (t) => {
  const running = {
    id: "job-1",
    state: "running",
    problem: null,
    progress: { note: "depth" },
    result_url: null,
  };
  const answers = /** @type {Record<string, object>} */ ({
    "/fixations/fix-1/full_resolution": running,
    "/jobs/job-1": {
      ...running,
      state: "succeeded",
      result_url: "/api/v1/clouds/cld-2",
    },
    "/clouds/cld-2": FULL,
  });
  t.mock.timers.enable({ apis: ["setTimeout"] });
  t.mock.method(globalThis, "fetch", (/** @type {string} */ url) =>
    Promise.resolve(Response.json(answers[String(url).replace(/^.*\/api\/v1/, "")])),
  );
  const store = new Store(only({ ...state(), current: { fixation: ANSWERED }, full_look: null }));
  const commands = only({
    send: async (/** @type {string} */ _, /** @type {string} */ path) => answers[path],
  });
  const looks = new FullResolution({
    store,
    commands,
    fixations: new Fixations(store),
  });
  await looks.look("fix-1");
  assert.deepEqual(
    [store.state.full_look?.state, store.state.full_look?.job_id, store.state.full_look?.note],
    ["running", "job-1", "depth"],
  );
  const ended = new Promise((resolve) => store.on(["full_look"], ({ full_look }) => full_look ?? resolve(null)));
  t.mock.timers.tick(700);
  await ended;
  await new Promise(setImmediate);
  assert.equal(store.state.current?.fixation?.cloud_id, "cld-2");
  assert.equal(largerLook(store.state, only(store.state.current?.fixation ?? {})), null);
});

test("the rig's page words the working binning, its cost, and what is in its way", () => {
  const now = binningWords(BINNING, SENSOR);
  assert.match(now.size, /^Looks, following and live views have 2×2 pixels as one: 720×540 of 1440×1080\. Stills/);
  assert.equal(now.cost, "Switching took 0.12 s.");
  assert.equal(binningWords({ ...BINNING, switch_s: 0.0001 }, SENSOR).cost, "Switching took less than 0.01 s.");
  assert.deepEqual([now.held, now.problem], ["", ""]);
  const full = binningWords({ ...BINNING, working_binning: 1, switch_s: null }, null);
  assert.equal(full.size, "Looks, following and live views have every pixel of the sensors.");
  assert.equal(full.cost, "Not switched yet: how long that takes is not known.");
  assert.equal(
    binningWords({ ...BINNING, in_force: 1, held_by: "a recording" }, SENSOR).held,
    "1×1 now, for a recording; 2×2 after it.",
  );
  const refused = "camera left: asked for binning 2, and it has 1; use 1";
  assert.equal(
    binningWords({ ...BINNING, in_force: 1, problem: refused }, SENSOR).problem,
    "The cameras stay as they are: Camera left: asked for binning 2, and it has 1; use 1.",
  );
});
