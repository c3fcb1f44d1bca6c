import assert from "node:assert/strict";
import { test } from "node:test";
import * as words from "../foveacam_web/static/js/operating/engine/flow_words.js";
import { only } from "./documents.js";

/** @param {string} source @param {string} target @param {object} [more] */
function edge(source, target, more = {}) {
  const still = { rate_hz: 0, dropped_hz: 0, mb_per_s: null, count: 0, dropped: 0, flagged: false };
  return { source, target, items: "frames", ...still, ...more };
}

/** @param {string} name @param {string} kind */
function part(name, kind) {
  return { name, kind, busy_share: null, waiting: null, flagged: false };
}

const HARDWARE = { name: "foveacam-hardware", kind: "thread", busy_share: 0.41, waiting: 2, flagged: false };
const CAMERA = { name: "camera left", kind: "camera", busy_share: null, waiting: null, flagged: true };
const ENGINE = only({
  parts: [HARDWARE, CAMERA, part("view wide", "view"), part("viewers", "clients")],
  edges: [
    edge("view wide", "viewers"),
    edge("foveacam-hardware", "view wide", { items: "pictures", rate_hz: 9.96, mb_per_s: 15.52, count: 20_000 }),
    edge("camera left", "foveacam-hardware", {
      ...{ rate_hz: 12.04, dropped_hz: 0.5, count: 1200, dropped: 7, flagged: true },
    }),
  ],
});

test("parts have names for people", () => {
  const names = [HARDWARE, CAMERA, { name: "view wide_depth", kind: "view" }, { name: "3D pane", kind: "clients" }];
  assert.deepEqual(
    names.map((part) => words.partName(only(part))),
    ["Hardware thread", "Camera left", "View wide depth", "3D pane"],
  );
  assert.equal(words.partName({ name: "foveacam-live-stereo", kind: "thread" }), "Live stereo");
});

test("a part says what it does now", () => {
  assert.equal(words.partWords(only(HARDWARE)), "Hardware thread, 41 % busy, 2 waiting");
  assert.equal(words.partWords(only(CAMERA)), "Camera left, does not keep up");
});

test("the table has a row for each way, from the cameras on, with its rate, size, number and loss", () => {
  assert.deepEqual(words.flowRows(ENGINE), [
    {
      flagged: true,
      idle: false,
      cells: [
        "Camera left, does not keep up",
        "Hardware thread, 41 % busy, 2 waiting",
        "12.0 frames/s",
        "",
        "1\u202f200",
        "0.50/s, 7 in all",
      ],
    },
    {
      flagged: false,
      idle: false,
      cells: ["Hardware thread, 41 % busy, 2 waiting", "View wide", "9.96 pictures/s", "16 MB/s", "20\u202f000", ""],
    },
    {
      flagged: false,
      idle: true,
      cells: ["View wide", "Viewers", "0.00 frames/s", "", "0", ""],
    },
  ]);
});
