import assert from "node:assert/strict";
import { test } from "node:test";
import * as words from "../foveacam_web/static/js/operating/engine/words.js";
import { only } from "./documents.js";

const WELL = {
  hardware: { queue_length: 1, queue_limit: 32, busy_share: 0.094, flagged: false },
  event_loop: { worst_lag_ms: 12, window_s: 10, flagged: false },
  threads: [thread("foveacam-hardware", 0.05)],
  cameras: [{ role: "left", flagged: false, lost_last_minute: 0 }],
  views: [view("wide", 14.6), { ...view("wide_depth", 0.1), expected_hz: null }],
};

/** @param {string} name @param {number} rate_hz @param {string | null} [slow_reason] */
function view(name, rate_hz, slow_reason = null) {
  return { view: name, rate_hz, expected_hz: 15, slow_reason };
}

/** @param {string} name @param {number | null} share */
function thread(name, share, count = 1) {
  return { name, count, cpu_share: share, busiest_share: share, flagged: share !== null && share >= 0.9 };
}

test("while nothing is flagged everything keeps up, with the rates that this rests on", () => {
  const sentences = ["Everything keeps up.", "Live pictures a second: wide 15 of 15."];
  assert.deepEqual(words.verdict(only(WELL)), { tone: "good", sentences });
  const unwatched = only({ ...WELL, views: [] });
  assert.deepEqual(words.verdict(unwatched), { tone: "good", sentences: ["Everything keeps up."] });
});

test("what does not keep up is told with what it means", () => {
  const found = words.verdict(
    only({
      hardware: { ...WELL.hardware, busy_share: 0.94, flagged: true },
      event_loop: { worst_lag_ms: 320, window_s: 10, flagged: true },
      threads: [thread("encoder", 0.97), thread("foveacam-hardware", 0.92)],
      cameras: [
        { role: "left", flagged: true, lost_last_minute: 12 },
        { role: "right", flagged: true, lost_last_minute: 1 },
      ],
      views: [view("wide", 0.6, "the scene is drawn no faster")],
    }),
  );
  assert.equal(found.tone, "warn");
  assert.deepEqual(found.sentences, [
    "The hardware thread is busy 94 % of the time: live views get slower.",
    "The event loop was 320 ms late: pages and orders are answered late.",
    "The thread encoder uses 97 % of a core: its work waits.",
    "The left camera lost 12 frames in the last minute.",
    "The right camera lost 1 frame in the last minute.",
    "The wide view shows 0.6 of 15 pictures a second: the scene is drawn no faster.",
  ]);
});

test("threads that do nothing are named in one line, and what is unknown is a row", () => {
  const threads = [
    thread("foveacam-hardware", 0.05),
    thread("requests", 0.001, 3),
    thread("foveacam-jobs", 0),
    thread("of libraries", null),
  ];
  const { working, idle } = words.workingAndIdle(threads);
  assert.deepEqual(
    working.map(({ name }) => name),
    ["foveacam-hardware", "of libraries"],
  );
  assert.deepEqual(idle, ["foveacam-jobs", "requests × 3"]);
});

test("shares are told as precisely as they are large", () => {
  assert.deepEqual([0, 0.012, 0.94, 1.02, null].map(words.percent), ["0 %", "1.2 %", "94 %", "102 %", "–"]);
});

test("what the system does not tell is a dash", () => {
  const process = {
    began_utc: null,
    up_s: null,
    services_opened_s: null,
    cores: 2,
    cpu_share: null,
    memory_mb: null,
    open_files: null,
    open_files_limit: 1024,
    database_mb: 0.25,
  };
  assert.deepEqual(words.processRows(only({ process, version: "0.1.0" })), [
    ["Version", "0.1.0"],
    ["Runs for", "–"],
    ["CPU", "–"],
    ["Memory", "–"],
    ["Open files", "–"],
    ["Database", "0.3 MB"],
  ]);
  assert.equal(words.startWords(process), "The operating system does not report when the process began.");
});

test("the start tells when each step began and how long it took", () => {
  const process = only({ began_utc: "2026-03-02T10:00:00Z", services_opened_s: 29.7 });
  assert.equal(
    words.startWords(process),
    "The process began on 2026-03-02 10:00:00 UTC; its services were open 29.7 s later.",
  );
  const step = { device: "pan_tilt", state: "done", after_s: 30.872, duration_s: 0.007 };
  assert.deepEqual(words.startRow(step), ["pan-tilt", "done", "30.9 s", "0.01 s"]);
  assert.deepEqual(words.startRow({ ...step, duration_s: null }).at(-1), "–");
});

test("the saved file has form, version and time", () => {
  const { name, content } = words.savedFile(only({ utc: "2026-03-02T10:00:00.123Z" }), null);
  assert.equal(name, "engine-2026-03-02T10.00.00Z.json");
  assert.deepEqual(JSON.parse(content), {
    format: "foveacam-engine",
    version: 1,
    engine: { utc: "2026-03-02T10:00:00.123Z" },
    mirrors: null,
  });
});
