import assert from "node:assert/strict";
import { test } from "node:test";
import * as words from "../foveacam_web/static/js/operating/engine/flow_words.js";
import { BOX, columnsOf, layered } from "../foveacam_web/static/js/operating/engine/layers.js";
import { only } from "./documents.js";

const LINES = [
  ["event loop", "foveacam-jobs"],
  ["foveacam-jobs", "foveacam-hardware"],
  ["camera wide", "foveacam-hardware"],
  ["camera left", "foveacam-hardware"],
  ["foveacam-hardware", "view wide"],
  ["foveacam-hardware", "foveacam-live-stereo"],
  ["foveacam-live-stereo", "view depth"],
  ["view wide", "encoder"],
  ["view depth", "encoder"],
  ["encoder", "viewers"],
].map(([source, target]) => ({ source: source ?? "", target: target ?? "" }));

test("a part stands right of all that feed it, and a source beside what it feeds", () => {
  const columns = columnsOf(LINES);
  for (const { source, target } of LINES) assert.ok((columns.get(source) ?? 0) < (columns.get(target) ?? 0));
  assert.equal(columns.get("camera wide"), 1);
  assert.equal(columns.get("viewers"), 6);
});

test("parts that feed each other are placed, and a part that feeds itself too", () => {
  const round = [
    { source: "a", target: "b" },
    { source: "b", target: "c" },
    { source: "c", target: "a" },
    { source: "c", target: "c" },
  ];
  assert.deepEqual(
    [...columnsOf(round)],
    [
      ["a", 0],
      ["b", 1],
      ["c", 2],
    ],
  );
  assert.equal(layered(round).routes.length, 4);
});

test("no two boxes overlap, and every line ends at its box", () => {
  const { boxes, routes, width, height } = layered(LINES);
  for (const box of boxes) {
    assert.ok(box.x >= 0 && box.x + BOX.width <= width && box.y >= 0 && box.y + box.height <= height + 1e-9);
    const others = boxes.filter((other) => other !== box && other.x === box.x);
    assert.ok(others.every((other) => other.y >= box.y + box.height || other.y + other.height <= box.y));
  }
  for (const { line, end, path } of routes) {
    const box = boxes.find(({ name }) => name === LINES[line]?.target);
    assert.ok(box && end.x === box.x && end.y > box.y && end.y < box.y + box.height);
    assert.match(path, /^M[\d.]+ [\d.]+C/);
  }
});

test("lines that arrive at one box end apart, in the order of their sources", () => {
  const { boxes, routes } = layered(LINES);
  const top = (/** @type {string} */ name) => boxes.find((box) => box.name === name)?.y ?? Number.NaN;
  const arriving = routes.filter(({ line }) => LINES[line]?.target === "foveacam-hardware");
  const sorted = [...arriving].sort((a, b) => a.end.y - b.end.y);
  assert.equal(new Set(arriving.map(({ end }) => end.y)).size, 3);
  const tops = sorted.map(({ line }) => top(LINES[line]?.source ?? ""));
  assert.deepEqual(
    tops,
    [...tops].sort((a, b) => a - b),
  );
});

test("a line that crosses a column has a place of its own there", () => {
  const { boxes, routes } = layered(LINES);
  const crossing = routes.find(({ line }) => LINES[line]?.source === "view wide");
  const lane = /H[\d.]+/.exec(crossing?.path ?? "")?.[0];
  assert.ok(lane, crossing?.path);
  const right = Number(lane.slice(1));
  const y = Number(/ ([\d.]+)H/.exec(crossing?.path ?? "")?.[1]);
  const crossed = boxes.filter((box) => box.x + BOX.width === right);
  assert.ok(crossed.length > 0 && crossed.every((box) => y <= box.y || y >= box.y + box.height));
});

test("nothing is placed where nothing flows, and the same lines are placed alike", () => {
  assert.deepEqual(layered([]), { width: 0, height: 0, boxes: [], routes: [] });
  assert.deepEqual(layered(LINES), layered(LINES));
});

/** @param {string} source @param {string} target @param {object} [more] */
function edge(source, target, more = {}) {
  const still = { rate_hz: 0, dropped_hz: 0, mb_per_s: null, count: 0, dropped: 0, flagged: false };
  return { source, target, items: "frames", ...still, ...more };
}

const HARDWARE = { name: "foveacam-hardware", kind: "thread", busy_share: 0.41, waiting: 2, flagged: false };
const CAMERA = { name: "camera left", kind: "camera", busy_share: null, waiting: null, flagged: true };
const ENGINE = only({
  hardware: { queue_limit: 32 },
  parts: [HARDWARE, CAMERA, { name: "view wide", kind: "view" }],
  edges: [
    edge("camera left", "foveacam-hardware", { rate_hz: 12.04, dropped_hz: 0.5, count: 1200, dropped: 7 }),
    edge("foveacam-hardware", "view wide", { items: "pictures", rate_hz: 9.96, mb_per_s: 15.52, count: 20_000 }),
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

test("rates are as short as they may be", () => {
  assert.deepEqual([0, 0.02, 9.96, 12.04, 350].map(words.shortRate), ["", "0.02/s", "10.0/s", "12/s", "350/s"]);
});

test("a part says what it does now", () => {
  assert.equal(words.partState(only(HARDWARE), ENGINE), "41 % busy, 2 waiting");
  assert.equal(words.partState(only(CAMERA), ENGINE), "12/s");
  assert.equal(words.partState(only({ ...CAMERA, name: "view wide", kind: "view" }), ENGINE), "10.0/s, 16 MB/s");
  assert.equal(words.partState(only({ ...CAMERA, name: "camera wide" }), ENGINE), "at rest");
});

test("a part is told in one sentence and in rows", () => {
  assert.equal(
    words.partWords(only(HARDWARE), ENGINE),
    "Hardware thread, 41 % busy, 2 waiting, fed by Camera left, feeds View wide",
  );
  assert.deepEqual(words.partDetails(only(HARDWARE), ENGINE), [
    ["Kind", "Thread"],
    ["Busy", "41 %"],
    ["Waiting", "2 of 32"],
    ["From Camera left", "12.0 frames/s, 1\u202f200 in all, 7 dropped (0.50/s)"],
    ["To View wide", "9.96 pictures/s (16 MB/s), 20\u202f000 in all"],
  ]);
});
