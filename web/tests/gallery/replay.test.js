// Replay: the timeline's arithmetic, tracks and their order, 3D modes as layouts, and uploads in parts.

import assert from "node:assert/strict";
import test from "node:test";

import { PlayerClock } from "../../foveacam_web/static/js/capturing/replay/clock.js";
import { Newest } from "../../foveacam_web/static/js/capturing/replay/newest.js";
import * as scale from "../../foveacam_web/static/js/capturing/replay/scale.js";
import { isShowable, stereoOf, withStereo } from "../../foveacam_web/static/js/capturing/replay/stereo.js";
import * as tracks from "../../foveacam_web/static/js/capturing/replay/tracks.js";
import { nameOf, sendRecording } from "../../foveacam_web/static/js/capturing/replay/upload.js";
import { layoutOf, layoutText } from "../../foveacam_web/static/js/operating/windows/layout.js";
import { only } from "../documents.js";

test("the wheel zooms about the moment under the pointer, and not beyond the recording", () => {
  const span = scale.zoomed({ from_s: 0, to_s: 10 }, 2, 8, 10);
  assert.deepEqual(span, { from_s: 4, to_s: 9 });
  assert.deepEqual(scale.zoomed(span, 0.01, 8, 10), { from_s: 0, to_s: 10 });
  const closest = scale.zoomed({ from_s: 0, to_s: 10 }, 1e9, 5, 10);
  assert.ok(closest.to_s - closest.from_s > 0.004);
  assert.ok(closest.from_s <= 5 && closest.to_s >= 5);
});

test("a pan stays within the recording, and a pull beyond its end is felt", () => {
  assert.deepEqual(scale.panned({ from_s: 2, to_s: 4 }, -5, 10), { from_s: 0, to_s: 2 });
  assert.deepEqual(scale.pulled({ from_s: 2, to_s: 4 }, 1, 10), { from_s: 3, to_s: 5 });
  assert.deepEqual(scale.pulled({ from_s: 2, to_s: 4 }, 9, 10), { from_s: 9, to_s: 11 });
  assert.deepEqual(scale.within({ from_s: 9, to_s: 11 }, 10), { from_s: 8, to_s: 10 });
});

test("the timeline follows what plays out of it", () => {
  const span = { from_s: 2, to_s: 4 };
  assert.equal(scale.following(span, 3, 10), span);
  assert.deepEqual(scale.following(span, 4.5, 10), { from_s: 4.3, to_s: 6.3 });
  assert.deepEqual(scale.following(span, 9.9, 10), { from_s: 8, to_s: 10 });
});

test("the ruler has round times as close as they can be read", () => {
  const words = (/** @type {number} */ from_s, /** @type {number} */ to_s, /** @type {number} */ width) =>
    scale.ticksOf({ from_s, to_s }, width).map(({ text }) => text);
  assert.deepEqual(words(0, 10, 700), [
    "0:00",
    "0:01",
    "0:02",
    "0:03",
    "0:04",
    "0:05",
    "0:06",
    "0:07",
    "0:08",
    "0:09",
    "0:10",
  ]);
  assert.deepEqual(words(1.03, 1.21, 210), ["0:01.1", "0:01.2"]);
  assert.deepEqual(words(0, 3600, 350), ["0:00", "15:00", "30:00", "45:00", "1:00:00"]);
  assert.ok(words(0, 86_400, 50).length <= 2);
});

/** @returns {import("#api").TrackDocument} */
const track = (/** @type {object} */ part) =>
  only({ kind: "frames", name: "left", role: "left", count: 9, period_s: 0.1, runs: [[0, 1]], drops: [], ...part });

test("tracks keep their arrangement, and one that is new comes after it", () => {
  const found = [track({}), track({ name: "center", role: "wide" }), track({ name: "A", kind: "boxes", role: null })];
  const rows = tracks.rowsOf(found, [
    { name: "frames:center", on: false },
    { name: "frames:left", on: true },
  ]);
  assert.deepEqual(
    rows.map((row) => [tracks.trackName(row.track), row.on]),
    [
      ["Wide", false],
      ["Left", true],
      ["Boxes A", true],
    ],
  );
  const moved = tracks.arrangementOf(tracks.reordered(rows, 2, 0)).map(({ name }) => name);
  assert.deepEqual(moved, ["boxes:A", "frames:center", "frames:left"]);
  assert.equal(tracks.reordered(rows, 0, -1), rows);
});

test("a pane says why it has no frame", () => {
  const gappy = track({
    runs: [
      [1, 2],
      [5, 6],
    ],
  });
  assert.equal(tracks.absenceOf(gappy, 1.5), "");
  assert.equal(tracks.absenceOf(gappy, 0.2), "It begins at 0:01.00.");
  assert.equal(tracks.absenceOf(gappy, 3), "Nothing came from 0:02.00 to 0:05.00.");
  assert.equal(tracks.absenceOf(gappy, 2.1), "");
  assert.equal(tracks.absenceOf(gappy, 7), "It ends at 0:06.00.");
  assert.equal(tracks.absenceOf(track({ runs: [] }), 0), "It holds no frame.");
});

test("a track tells what it holds", () => {
  const words = tracks.trackWords(
    track({
      runs: [
        [0, 1],
        [2, 3],
      ],
      drops: [
        [0.2, 0.4, 1],
        [0.5, 0.8, 2],
      ],
    }),
  );
  assert.equal(words, "Left: 9 frames, 10.0 Hz, 1 gap, 3 missing by its period");
});

test("the 3D modes change the foveae's panes and leave the wide view", () => {
  const layout = layoutOf("row-640(wide,column-500(left,right))") ?? "wide";
  for (const [mode, text] of /** @type {const} */ ([
    ["anaglyph", "row-640(wide,anaglyph)"],
    ["difference", "row-640(wide,difference)"],
    ["right", "row-640(wide,right)"],
    ["off", "row-640(wide,column-500(left,right))"],
  ])) {
    const turned = withStereo(layout, mode);
    assert.equal(layoutText(turned), text);
    assert.equal(stereoOf(turned), mode);
    assert.equal(layoutText(withStereo(turned, "off")), "row-640(wide,column-500(left,right))");
  }
  assert.equal(layoutText(withStereo("wide", "left")), "row-500(wide,left)");
  assert.equal(layoutText(withStereo("right", "anaglyph")), "anaglyph");
});

test("a layout with what the player has not is not used", () => {
  assert.equal(isShowable(layoutOf("row-500(wide,anaglyph)")), true);
  assert.equal(isShowable(layoutOf("row-500(wide,scene)")), false);
  assert.equal(isShowable(null), false);
});

test("the focused camera's frames are stepped through, else all", () => {
  const streams = [only({ name: "left", t_s: [0, 0.2] }), only({ name: "center", t_s: [0.1, 0.3] })];
  const clock = new PlayerClock({ duration_s: 0.3, calibrated: true, streams }, () => {});
  assert.equal(clock.steps, 4);
  clock.stepThrough("center");
  clock.go(1);
  assert.deepEqual([clock.steps, clock.at_s], [2, 0.3]);
  clock.stepThrough("");
  assert.equal(clock.steps, 4);
});

test("of pictures that are wanted quickly the newest is loaded", async () => {
  /** @type {string[]} */
  const loaded = [];
  const newest = new Newest(async (what) => {
    loaded.push(what);
    await Promise.resolve();
  });
  const first = newest.want("a");
  void newest.want("b");
  void newest.want("c");
  await first;
  assert.deepEqual(loaded, ["a", "c"]);
});

/**
 * Answer requests as the server does, and note them.
 * @param {import("node:test").TestContext} context
 * @param {{lose?: number, refuse?: boolean}} [options] `lose`: number of the part whose answer is lost
 */
function server(context, { lose = -1, refuse = false } = {}) {
  const [size, part] = [10, 4];
  let [received, parts] = [0, 0];
  /** @type {string[]} */
  const asked = [];
  const document = () => ({
    id: "upl-1",
    size_bytes: size,
    part_bytes: part,
    received_bytes: received,
    recording: received === size ? { id: "rec-1" } : null,
  });
  context.mock.method(
    globalThis,
    "fetch",
    async (/** @type {string} */ path, /** @type {RequestInit} */ { method, body }) => {
      asked.push(`${method} ${path}`);
      if (method === "PUT" && refuse) return Response.json({ detail: "the disk is full" }, { status: 507 });
      if (method === "PUT") {
        received += /** @type {Blob} */ (body).size;
        parts += 1;
        if (parts === lose) throw new TypeError("the connection was lost");
      }
      return method === "DELETE" ? new Response(null, { status: 204 }) : Response.json(document());
    },
  );
  return asked;
}

test("a recording is sent in parts, and its name has no suffix", async (context) => {
  const asked = server(context);
  /** @type {number[]} */
  const reported = [];
  const file = new File(["0123456789"], "walk.FCAP");
  const cancelled = new AbortController().signal;
  const made = await sendRecording(file, {
    name: nameOf(file.name),
    onProgress: (sent) => reported.push(sent),
    cancelled,
  });
  assert.equal(made?.id, "rec-1");
  assert.equal(nameOf(file.name), "walk");
  assert.deepEqual(reported, [0, 4, 8]);
  assert.deepEqual(asked, [
    "POST /api/v1/recordings/uploads",
    "PUT /api/v1/recordings/uploads/upl-1?at=0",
    "PUT /api/v1/recordings/uploads/upl-1?at=4",
    "PUT /api/v1/recordings/uploads/upl-1?at=8",
  ]);
});

test("after a lost connection it goes on where the server is", async (context) => {
  context.mock.timers.enable({ apis: ["setTimeout"] });
  const asked = server(context, { lose: 2 });
  const file = new File(["0123456789"], "walk.fcap");
  const sent = sendRecording(file, { name: "walk", onProgress: () => {}, cancelled: new AbortController().signal });
  for (let turn = 0; turn < 50; turn += 1) {
    await new Promise((resolve) => setImmediate(resolve));
    context.mock.timers.tick(1000);
  }
  assert.equal((await sent)?.id, "rec-1");
  assert.deepEqual(asked.slice(3), [
    "GET /api/v1/recordings/uploads/upl-1",
    "PUT /api/v1/recordings/uploads/upl-1?at=8",
  ]);
});

test("an upload that is refused is taken back", async (context) => {
  const asked = server(context, { refuse: true });
  const file = new File(["0123456789"], "walk.fcap");
  const sent = sendRecording(file, { name: "walk", onProgress: () => {}, cancelled: new AbortController().signal });
  await assert.rejects(sent, /disk is full/);
  assert.equal(asked.at(-1), "DELETE /api/v1/recordings/uploads/upl-1");
});

test("a cancelled upload is taken back", async (context) => {
  const asked = server(context);
  const stop = new AbortController();
  const file = new File(["0123456789"], "walk.fcap");
  const made = await sendRecording(file, { name: "walk", onProgress: () => stop.abort(), cancelled: stop.signal });
  assert.equal(made, null);
  assert.equal(asked.at(-1), "DELETE /api/v1/recordings/uploads/upl-1");
});
