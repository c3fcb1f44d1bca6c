import assert from "node:assert/strict";
import { test } from "node:test";
import * as datasets from "../../foveacam_web/static/js/capturing/gallery/dataset_words.js";
import * as exported from "../../foveacam_web/static/js/capturing/gallery/export_words.js";
import { DepthTile, ticksOf } from "../../foveacam_web/static/js/capturing/gallery/mosaic/depth.js";
import { percent, size } from "../../foveacam_web/static/js/capturing/gallery/mosaic/words.js";
import { frameAt, PlayerClock } from "../../foveacam_web/static/js/capturing/replay/clock.js";
import * as recordings from "../../foveacam_web/static/js/capturing/gallery/recording_words.js";
import { referenceWords } from "../../foveacam_web/static/js/capturing/gallery/reference_words.js";
import { actWords, removedWords, ruleWords } from "../../foveacam_web/static/js/preferences/retention_words.js";
import { only } from "../documents.js";

/**
 * @typedef {import("#api").CaptureDocument} CaptureDocument
 * @typedef {import("#api").RecordingDocument} RecordingDocument
 * @typedef {import("#api").RecordedStreamDocument} RecordedStreamDocument
 */

/** @param {Partial<CaptureDocument>} fields */
const dataset = (fields) => /** @type {CaptureDocument} */ ({ state: "partial", why: "", progress: null, ...fields });

test("a dataset says its state and its points", () => {
  const points = { planned: 9, taken: 2, skipped: 1, scans: 1, frames: 6 };
  assert.deepEqual(datasets.stateWords(dataset({})), { text: "Partial", tone: "warn" });
  assert.equal(datasets.pointsWords(dataset({ points })), "2 of 9 points, 1 passed over");
  assert.equal(datasets.pointsWords(dataset({ points: { ...points, taken: 9, skipped: 0 } })), "9 points");
  assert.equal(datasets.pointsWords(dataset({ state: "damaged", points })), "");
  assert.deepEqual([datasets.isLive({ state: "paused" }), datasets.isLive({ state: "complete" })], [true, false]);
});

test("a capture that runs says how far it is, or what it waits for", () => {
  /** @type {import("#api").CaptureProgress} */
  const progress = {
    phase: "points",
    done: 40,
    total: 81,
    left_s: 12,
    stored: 40,
    written_bytes: 1,
    bytes_per_s: 1,
    note: "",
  };
  assert.equal(datasets.progressWords(dataset({ progress })), "40 of 81 · 12 s left");
  assert.equal(
    datasets.progressWords(dataset({ progress: { ...progress, phase: "rail", left_s: null } })),
    "40 of 81 · moving on the rail",
  );
  assert.equal(datasets.progressWords(dataset({ progress, why: "push the rig to 100 mm" })), "Push the rig to 100 mm.");
  assert.equal(datasets.progressWords(dataset({})), "Waiting for the rig.");
});

test("a point says where it aimed and where the eyes met", () => {
  /** @type {import("#api").PointDocument} */
  const point = {
    index: 0,
    scan: 1,
    sheet_row: 0,
    sheet_column: 0,
    aim_ax_deg: 1,
    aim_ay_deg: -2,
    distance_m: 3,
    rail_mm: 100,
    cameras: [],
    brackets: 1,
  };
  assert.equal(
    datasets.pointWords(point, 2),
    "scan 2 · +1.00° across, −2.00° down · eyes meet at 3.00 m · rail at 100.0 mm",
  );
  assert.equal(
    datasets.pointWords({ ...point, distance_m: null, rail_mm: null }),
    "+1.00° across, −2.00° down · eyes parallel",
  );
  assert.equal(datasets.pointWords({ ...point, aim_ax_deg: null, rail_mm: null }), "");
});

test("a plan is told in sentences, and what is unknown in it is left out", () => {
  const plan = {
    points: {
      kind: "grid",
      columns: 9,
      rows: 3,
      half_width_deg: 8,
      half_height_deg: null,
      centre_ax_deg: 1,
      order: "serpentine",
    },
    verging: { mode: "scene", distance_m: 2.5, each_point: true },
    exposures_ms: [2, 8],
    stack_frames: 4,
    stack_keep: "mean",
    wide: "scan",
    rail_positions_mm: [-100, 0],
  };
  assert.deepEqual(datasets.planWords(plan), [
    "9 × 3 points, every other row backwards: −7.0° … +9.0° across, as far as the rig steers down.",
    "Both eyes meet at 2.50 m, the scene's average as it was measured; verged again at every point.",
    "Bracket of 2, 8 ms, 4 frames each, kept as their mean.",
    "One wide picture a scan.",
    "2 scans, from −100, 0 mm on the rail.",
  ]);
  assert.deepEqual(datasets.planWords({ points: { kind: "set_points", points: [1, 2] } }), [
    "2 set points, in their order.",
  ]);
  assert.deepEqual(datasets.planWords({ points: "of a later version" }), []);
  assert.deepEqual(datasets.planWords(null), []);
});

test("a dataset's facts leave out what it does not say, and Python loads it by its real path", () => {
  const points = { planned: 9, taken: 5, skipped: 0, scans: 2, frames: 15 };
  const shown = dataset({
    points,
    id: "cap-1",
    folder: '/data/a "b"',
    size_bytes: 2e6,
    codec: "tiff",
    created_utc: null,
  });
  assert.deepEqual(datasets.factRows({ ...shown, rig_id: null }), [
    ["Points", "5 of 9 points"],
    ["Pictures", "15 in 2 scans"],
    ["Size", "2.0 MB"],
    ["Format", "TIFF"],
    ["Id", "cap-1"],
    ["Folder", '/data/a "b"'],
  ]);
  const lines = datasets.localLines({ ...shown, calibration_id: null }).split("\n");
  assert.deepEqual(lines.slice(1, 3), ['dataset = Dataset.open("/data/a \\"b\\"")', "point = dataset[2]"]);
  assert.equal(lines[4], "wide = point.wide");
});

test("Python on another machine reads a dataset by the server's address, with a token where it asks for one", () => {
  const address = "https://lab.example/foveacam";
  assert.deepEqual(datasets.remoteLines({ id: "cap-1" }, { address, named: false }).split("\n"), [
    "import foveacam_client",
    'rig = foveacam_client.connect("https://lab.example/foveacam")',
    'dataset = rig.dataset("cap-1")',
    "point = dataset[0]  # .left, .right, .wide: arrays",
    "print(len(dataset), point)",
  ]);
  assert.match(datasets.remoteLines({ id: "cap-1" }, { address, named: true }), /connect\(".*", token=TOKEN\)/);
});

test("an export says what it is for, how far it is, and the line that loads it", () => {
  const { colmap, nerfstudio, "hugging-face": rows, "ome-zarr": pictures } = exported.EXPORT_KINDS;
  assert.equal(colmap?.load("desk-colmap"), "colmap gui --import_path desk-colmap/sparse/0");
  assert.equal(nerfstudio?.load("my desk's"), "ns-train splatfacto --data 'my desk'\\''s'");
  assert.equal(rows?.load("a b"), 'import datasets; rows = datasets.load_dataset("a b", split="train")');
  assert.match(pictures?.load("desk-ome-zarr") ?? "", /open_group\("desk-ome-zarr\/left\.ome\.zarr", mode="r"\)/);
  const progress = { done: 3, total: 11, eta_s: 40, note: "writing the points" };
  assert.equal(exported.exportProgress(progress), "Writing the points · step 3 of 11 · 40 s left");
  assert.equal(exported.exportProgress(null), "Reading the dataset");
  assert.equal(exported.largestWords(2e6), "At most 2.0 MB");
});

test("conditions become rows of names and values", () => {
  const conditions = {
    scene: "bench",
    settle_us: 14_000,
    pan_rad: 0,
    tilt_rad: Math.PI / 180,
    cameras: { wide: { exposure_ns: 8e6, gain_db: 0, pixel_format: "Mono8", frame_rate_hz: 120 } },
    survey_distances_m: [2.5, null],
  };
  assert.deepEqual(datasets.conditionRows(conditions), [
    ["Scene", "bench"],
    ["Wait after a move", "14 ms"],
    ["Wide camera", "8 ms, 0 dB, Mono8, 120 Hz"],
    ["Pan, tilt", "+0.00°, +1.00°"],
    ["Scene measured at", "2.50, – m"],
  ]);
});

/** @param {Partial<RecordedStreamDocument>} fields */
const stream = (fields) => /** @type {RecordedStreamDocument} */ ({ frames: 100, dropped: 0, losses: {}, ...fields });
/** @param {Partial<RecordingDocument>} fields */
const recording = (fields) =>
  /** @type {RecordingDocument} */ ({
    state: "complete",
    ended: "stopped",
    streams: [stream({}), stream({})],
    size_bytes: 5e6,
    ...fields,
  });

test("a recording says how it ended and what it holds", () => {
  assert.equal(recordings.stateWords(recording({})).text, "Complete");
  assert.equal(recordings.stateWords(recording({ ended: "disk_reserve" })).text, "Ended early");
  assert.equal(recordings.stateWords(recording({ state: "truncated" })).text, "Cut off");
  assert.equal(recordings.tallyWords(recording({})), "200 frames, none dropped, 5.0 MB");
  assert.equal(
    recordings.tallyWords(recording({ streams: [stream({ dropped: 3 })] })),
    "100 frames, 3 dropped, 5.0 MB",
  );
  assert.equal(recordings.tallyWords(recording({ streams: [stream({ dropped: null })] })), "100 frames, 5.0 MB");
});

test("frames that are missing are told with the reason", () => {
  assert.equal(
    recordings.lossWords(stream({ losses: { queue: 3, disk: 0, other: 1 } })),
    "3: the disk was slower than the cameras; 1: other.",
  );
  assert.equal(recordings.lossWords(stream({})), "");
});

test("a recording that is being made says when it ends and how long the disk has room", () => {
  assert.equal(
    recordings.boundWords(recording({ left_s: 65, room_s: 7200, room_bytes: 4e9 })),
    "ends by itself in 1:05; room for 2 h, 4.00 GB",
  );
  assert.equal(recordings.boundWords(recording({ left_s: null, room_s: null, room_bytes: null })), "");
});

test("moments are told as on a clock, and name a recording", () => {
  assert.deepEqual(
    [0, 59.999, 61.5, 3725].map((seconds) => recordings.clockWords(seconds)),
    ["0:00.00", "0:59.99", "1:01.50", "1:02:05.00"],
  );
  assert.equal(recordings.momentName(new Date(2026, 2, 4, 5, 6, 7)), "2026-03-04 05-06-07");
});

test("a player goes from frame to frame, and frames of one moment are one step", () => {
  const streams = /** @type {import("#api").TimelineStream[]} */ ([{ t_s: [0, 0.1, 0.2] }, { t_s: [0.0004, 0.15] }]);
  const clock = new PlayerClock({ duration_s: 0.2, calibrated: true, streams }, () => {});
  assert.equal(clock.steps, 4);
  clock.go(2);
  assert.deepEqual([clock.step, clock.at_s], [2, 0.15]);
  clock.go(-9);
  assert.equal(clock.step, 0);
  clock.seek(9);
  assert.deepEqual([clock.step, clock.at_s], [3, 0.2]);
  assert.equal(frameAt(/** @type {any} */ (streams[1]), 0.12), 0);
});

test("a player that plays stops at the end and begins anew from there", () => {
  const clock = new PlayerClock({ duration_s: 1, calibrated: true, streams: [only({ t_s: [0, 0.5] })] }, () => {});
  clock.shiftSpeed(1);
  clock.pass(0.1);
  assert.equal(clock.at_s, 0); // it rests
  clock.toggle();
  clock.pass(0.4);
  assert.deepEqual([clock.at_s, clock.playing], [0.8, true]);
  clock.pass(0.4);
  assert.deepEqual([clock.at_s, clock.playing], [1, false]);
  clock.toggle();
  assert.deepEqual([clock.at_s, clock.playing], [0, true]);
  clock.shiftSpeed(9);
  assert.equal(clock.speed, 4);
});

test("a mosaic's sizes, and shares are no finer than they are known", () => {
  assert.equal(size(12_345, 900), "12\u202f345 × 900 px");
  assert.deepEqual([0.25, 0.034, 0.0012, null].map(percent), ["25 %", "3.4 %", "0.12 %", "–"]);
});

test("a depth tile holds metres in three bytes, and nothing where they are zero", () => {
  const data = /** @type {ImageData} */ ({
    width: 2,
    height: 1,
    data: new Uint8ClampedArray([0, 1, 2, 255, 0, 0, 0, 255]),
  });
  const tile = new DepthTile(data, 0.001);
  assert.ok(Math.abs((tile.at(0, 0) ?? 0) - 0.258) < 1e-12);
  assert.deepEqual([tile.at(1, 0), tile.at(2, 0), tile.at(0, -1)], [null, null, null]);
  assert.deepEqual(ticksOf({ near_m: 1.2, far_m: 9 }), [2, 4, 6, 8]);
});

test("a reference is told with its spread, its bias and what was left out", () => {
  /** @type {import("#api").MadeReference} */
  const made = only({
    scan: 1,
    stops: [only({ scan: 1, rail_m: -0.3 })],
    referenced: 485,
    samples: 520,
    baseline_m: 0.8,
    short_baseline_m: 0.2,
    comparison: only({ rms_rel: 0.00034, bias_rel: -0.00012, stated_sigma_rel: 0.0002, wrong: 0.015 }),
  });
  const words = referenceWords(made);
  assert.match(words, /^From −300 mm on the rail, 485 of 520 samples have a reference over 800 mm in the median/);
  assert.match(words, /off it by 0\.034\u00a0% rms, bias −0\.012\u00a0%, without the 1\.5\u00a0% of samples/);
});

test("an archived entry says its size and what of it is here", () => {
  const archived = { url: "s3://rig/captures/a", utc: "2026-01-02T00:00:00Z", bytes: 7_000_000, local: true };
  assert.match(datasets.archivedWords(archived), /^7\.0 MB, .*All of it is here as well\.$/);
  assert.match(
    datasets.archivedWords({ ...archived, local: false }),
    /Only what is small is here; the rest is read from there\.$/,
  );
});

test("a rule of retention says what is kept", () => {
  assert.equal(ruleWords({ keep_days: null, keep_gb: null }), "kept for ever");
  assert.equal(ruleWords({ keep_days: 30, keep_gb: 0.5 }), "kept for 30 days, the newest 0.5 GB");
  const [trash, for_good] = [{ for_good: false }, { for_good: true }];
  assert.equal(actWords([trash]), "Move to the trash");
  assert.equal(actWords([for_good]), "Delete for good");
  assert.equal(actWords([trash, for_good]), "Remove, 1 of them for good");
  assert.equal(removedWords([trash, trash, for_good]), "2 moved to the trash, 1 deleted for good");
});
