import assert from "node:assert/strict";
import { test } from "node:test";
import { blamed } from "../../foveacam_web/static/js/capturing/capture/blame.js";
import {
  asSetPoints,
  denserGrid,
  placeOf,
  planOf,
  viewSize,
} from "../../foveacam_web/static/js/capturing/capture/plan.js";
import * as stills from "../../foveacam_web/static/js/capturing/capture/still_words.js";
import {
  endWords,
  farWords,
  percent,
  sizeText,
  spanRange,
  stateWords,
  timeWords,
} from "../../foveacam_web/static/js/capturing/capture/words.js";
import { pixelOf } from "../../foveacam_web/static/js/video/angles.js";
import { LENS, only, problem } from "../documents.js";

/**
 * @typedef {import("#page").PlanDraft} PlanDraft
 * @typedef {import("#page").Capturing} Capturing
 * @typedef {import("#page").CaptureEnd} CaptureEnd
 */

/** @type {PlanDraft} */
const DRAFT = {
  source: "grid",
  columns: 3,
  rows: 2,
  centre_ax_deg: 0,
  centre_ay_deg: 1,
  field: "all",
  across: null,
  down: null,
  order: "serpentine",
  text: "",
  mode: "scene",
  distance_m: null,
  assumed_m: null,
  each_point: false,
  exposures_ms: [],
  stack_frames: 1,
  stack_keep: "mean",
  wide: "point",
  rail_positions_mm: [],
};

/**
 * @param {Partial<PlanDraft>} fields
 * @param {import("#page").ViewSize | null} view
 */
function planned(fields, view = null) {
  const { plan, troubles } = planOf({ ...DRAFT, ...fields }, view);
  return { ...plan, places: troubles.map(({ place }) => place) };
}

test("a grid over the whole field leaves its extent to the server", () => {
  const { points, verging, places } = planned({});
  assert.deepEqual(points, {
    kind: "grid",
    columns: 3,
    rows: 2,
    centre_ax_deg: 0,
    centre_ay_deg: 1,
    half_width_deg: null,
    half_height_deg: null,
    order: "serpentine",
  });
  assert.deepEqual(verging, { mode: "scene", distance_m: null, each_point: false });
  assert.deepEqual(places, []);
});

test("a field given by steps or by overlap becomes half an extent", () => {
  const halves = (/** @type {Partial<PlanDraft>} */ fields) => {
    const { points } = planned(fields, { width_deg: 2.8, height_deg: 2 });
    return points.kind === "grid" ? [points.half_width_deg, points.half_height_deg] : [];
  };
  assert.deepEqual(halves({ field: "extent", across: 4, down: 3 }), [4, 3]);
  assert.deepEqual(halves({ field: "step", across: 1.5, down: 1 }), [1.5, 0.5]);
  assert.deepEqual(halves({ field: "overlap", across: 50, down: 0 }), [1.4, 1]);
  assert.deepEqual(halves({ field: "step", columns: 1, across: 1.5, down: 1 }), [0.75, 0.5]);
});

test("what is missing in a draft is told beside its field", () => {
  assert.deepEqual(planned({ columns: null, centre_ax_deg: null }).places, ["size", "centre"]);
  assert.deepEqual(planned({ mode: "given", stack_frames: null }).places, ["distance", "stack"]);
  assert.deepEqual(planned({ field: "step", across: 1 }).places, ["field"]);
  assert.deepEqual(planned({ field: "overlap", across: 100, down: 10 }, { width_deg: 2, height_deg: 2 }).places, [
    "field",
  ]);
  assert.deepEqual(planned({ field: "overlap", across: 10, down: 10 }).places, ["field"]); // no estimate yet
});

test("parallel eyes are a given distance without an end", () => {
  assert.deepEqual(planned({ mode: "parallel" }).verging, { mode: "given", distance_m: "infinity", each_point: false });
  assert.deepEqual(planned({ source: "set_points", text: "1, 1\n" }).points, { kind: "set_points", points: "1, 1\n" });
});

test("a grid is written in the language of set points", () => {
  const { points } = planned({ field: "extent", across: 2, down: 1 });
  assert.equal(points.kind, "grid");
  if (points.kind === "grid")
    assert.deepEqual(asSetPoints(points).split("\n").slice(2), [
      "-2, 0",
      "2, 0",
      "-2, 2",
      "2, 2",
      "@interpolate 3 2 zigzag",
      "",
    ]);
});

test("a serpentine grid goes back in every other row", () => {
  const grid = /** @type {const} */ ({ columns: 5, order: "serpentine" });
  assert.deepEqual(placeOf(only(grid), 4), { row: 0, column: 4 });
  assert.deepEqual(placeOf(only(grid), 5), { row: 1, column: 4 });
  assert.deepEqual(placeOf(only({ ...grid, order: "rows" }), 5), { row: 1, column: 0 });
});

test("the size of a view is measured by the corners of the middle footprint", () => {
  const corners = [
    [-1.4, -1],
    [1.4, -1],
    [1.4, 1],
    [-1.4, 1],
  ].map(([ax_deg = 0, ay_deg = 0]) => {
    const { x, y } = pixelOf(LENS, { ax_deg, ay_deg });
    return [x, y];
  });
  const size = viewSize(
    only({ coverage: only({ footprints: [only({ left: /** @type {[number, number][]} */ (corners) })] }) }),
    LENS,
  );
  assert.ok(size && Math.abs(size.width_deg - 2.8) < 1e-6 && Math.abs(size.height_deg - 2) < 1e-6);
  assert.equal(viewSize(only({ coverage: only({ footprints: [] }) }), LENS), null);
});

test("a denser grid has the fewest points whose views overlap by a fifth in the same field", () => {
  const view = { width_deg: 2.5, height_deg: 2 };
  const steps = { half_width_deg: 3, half_height_deg: 1.6 }; // of 2° and 1.6° at most
  assert.deepEqual(denserGrid(steps, view), { columns: 4, rows: 3 });
  assert.deepEqual(denserGrid({ ...steps, half_width_deg: 3.01 }, view), { columns: 5, rows: 3 });
});

test("a refusal is told beside the field that it is about, without the names of programs", () => {
  const told = (/** @type {string} */ detail) =>
    blamed(problem(detail), "grid").map(({ place, words }) => [place, words]);
  assert.deepEqual(told("plan.points.grid.columns is 200; needed is a value of at most 101."), [
    ["size", "200 was given; needed is a value of at most 101."],
  ]);
  assert.deepEqual(told("name is 'up/down'; needed is it contains '/', which separates folders."), [
    ["name", "it contains '/', which separates folders."],
  ]);
  assert.deepEqual(told("raster plan: 3 of 4 points are beyond reach."), [
    ["field", "3 of 4 points are beyond reach."],
  ]);
  assert.deepEqual(told("an exposure of 5000 ms was asked."), [["exposures", "an exposure of 5000 ms was asked."]]);
  assert.deepEqual(told("1000 mm on the rail is 695 mm beyond its end."), [
    ["rail", "1000 mm on the rail is 695 mm beyond its end."],
  ]);
  assert.deepEqual(told("set points, line 2: `@spin` is no command."), [["text", "line 2: `@spin` is no command."]]);
  assert.deepEqual(told("the disk is full."), [[null, "the disk is full."]]);
});

test("points beyond reach are those of the grid or those that were typed, and two refusals are told apart", () => {
  assert.equal(blamed(problem("the points are beyond reach."), "set_points")[0]?.place, "text");
  const both = blamed(
    problem("plan.stack_frames is 0; needed is 1. plan.exposures_ms is x; needed is a number."),
    "grid",
  );
  assert.deepEqual(
    both.map(({ place }) => place),
    ["stack", "exposures"],
  );
});

test("bytes are told in the unit that leaves three digits", () => {
  assert.deepEqual([0, 999, 9330, 9_330_000, 12_345_678, 999_600, 3.2e12].map(sizeText), [
    "0 B",
    "999 B",
    "9.33 kB",
    "9.33 MB",
    "12.3 MB",
    "1.00 MB",
    "3.20 TB",
  ]);
  assert.equal(sizeText(null), "–");
  assert.deepEqual([0, 0.034, 0.25, null].map(percent), ["0 %", "3.4 %", "25 %", "–"]);
});

/** @type {import("#api").CaptureProgress} */
const PROGRESS = {
  phase: "points",
  done: 2,
  total: 4,
  stored: 2,
  written_bytes: 9_330_000,
  bytes_per_s: 1e6,
  left_s: 12,
  note: "",
};
/** @type {Capturing} */
const RUNNING = {
  job_id: "job-1",
  capture_id: "c",
  name: "desk",
  state: "running",
  progress: PROGRESS,
  why: "",
  asked: null,
  end: null,
};

test("a running capture says what it does and how far it is", () => {
  assert.equal(farWords(RUNNING), "2 of 4, 12 s left, 9.33 MB at 1.00 MB/s");
  assert.equal(farWords({ ...RUNNING, state: "paused" }), "2 of 4, 9.33 MB at 1.00 MB/s");
  assert.equal(
    stateWords({ ...RUNNING, progress: { ...PROGRESS, phase: "survey" } }),
    "measuring the scene's distance",
  );
  assert.deepEqual(
    [{ asked: "pause" }, { asked: "cancel" }, { state: "paused" }, { why: "Push the rig." }, { progress: null }].map(
      (fields) => stateWords(/** @type {Capturing} */ ({ ...RUNNING, ...fields })),
    ),
    ["pausing after this point", "cancelling", "paused", "waits for you", "starting"],
  );
});

test("the end of a capture has a headline, the reason and what is on the disk", () => {
  const end = (/** @type {Partial<CaptureEnd>} */ fields) =>
    endWords({
      ...RUNNING,
      end: {
        job: "succeeded",
        state: "complete",
        why: "",
        problem: null,
        taken: 4,
        planned: 4,
        resumable: false,
        ...fields,
      },
    });
  assert.deepEqual(end({}), {
    tone: "good",
    head: "“desk”: complete",
    why: "4 of 4 points are on the disk.",
    remedy: "",
  });
  assert.deepEqual(end({ job: "cancelled", state: "partial", taken: 1, why: "cancelled after 1 of 4 points" }), {
    tone: "warn",
    head: "“desk”: cancelled",
    why: "Cancelled after 1 of 4 points.",
    remedy: "",
  });
  assert.deepEqual(
    end({ job: "failed", state: "partial", taken: 2, problem: { ...problem("no answer"), remedy: "plug it in" } }),
    {
      tone: "bad",
      head: "“desk”: failed",
      why: "No answer. 2 of 4 points are on the disk, and stay there.",
      remedy: "Plug it in.",
    },
  );
  assert.equal(
    end({ job: "failed", state: null, problem: problem("no answer") }).why,
    "No answer. Nothing was taken yet.",
  );
});

/** @type {import("#api").StillCamera} */
const CAMERA = only({
  camera: "left",
  asked: 5,
  came: 5,
  bits: 12,
  exposure_ms: 8,
  gain_db: 0,
  ax_deg: null,
  ay_deg: null,
  detail: "",
});

test("a still says what came of each camera", () => {
  assert.equal(stills.cameraWords(CAMERA), "5 frames · 12 bits · 8.0 ms");
  assert.equal(
    stills.cameraWords({ ...CAMERA, came: 2, gain_db: 6, ax_deg: 1, ay_deg: -2 }),
    "2 of 5 frames · 12 bits · 8.0 ms · 6.0 dB · +1.00° across, −2.00° down",
  );
  assert.equal(stills.cameraWords({ ...CAMERA, came: 0 }), "none of 5 frames");
  const still = only({
    cameras: [CAMERA, { ...CAMERA, camera: "right", came: 0, detail: "it stalled" }],
    stack_frames: 5,
    stack_keep: "mean",
  });
  assert.deepEqual(stills.missingWords(/** @type {any} */ (still)), ["Right eye: none of 5 frames came. It stalled."]);
  assert.equal(stills.stillWords(/** @type {any} */ (still)), "left eye · 5 frames each, their mean");
  assert.equal(stills.crossingWords(only({ distance_m: null })), "nowhere in front of the rig");
});

test("an estimated time is a range in the unit that suits it, rounded outwards", () => {
  assert.equal(spanRange(12.4, 24.2), "12 to 25 s");
  assert.equal(spanRange(2.71, 5.02), "2.7 to 5.1 s");
  assert.equal(spanRange(30, 95), "0.5 to 1.6 min");
  assert.equal(spanRange(700, 1300), "11 to 22 min");
  assert.equal(spanRange(3600, 7200), "1.0 to 2.0 h");
  assert.equal(spanRange(12, 12), "12 s");
  assert.equal(spanRange(0.24, 11.6), "0.2 to 12 s");
  assert.equal(spanRange(47, 5600), "47 s to 1.6 h");
  assert.equal(spanRange(9.6, 95), "9.6 s to 1.6 min");
});

test("an estimated time says what it is from", () => {
  const measured = {
    preparing_fixations: 9,
    preparing_low_s: 9,
    preparing_high_s: 18,
    rail_s: 0,
    hand_moves: 0,
    timed_captures: 3,
    limit_s: 2.7,
  };
  const words = (/** @type {object} */ more) => timeWords(only({ ...measured, ...more }));
  assert.equal(
    words({}),
    "9 to 18 s of it for 9 fixations that measure the distance, by the times of the last 3 captures",
  );
  assert.equal(
    words({ preparing_fixations: 0, timed_captures: 0, hand_moves: 5 }),
    "5 × you push the rig, not counted, " +
      "a guess before the first capture; settling, exposing and reading out alone take 2.7 s",
  );
  assert.equal(
    words({ preparing_fixations: 0, timed_captures: 1, rail_s: 20 }),
    "20 s on the rail, by the times of the last capture",
  );
});
