import assert from "node:assert/strict";
import { test } from "node:test";
import * as format from "../foveacam_web/static/js/elements/format.js";

test("a number has a real minus sign, no minus zero, and a dash where it is missing", () => {
  assert.equal(format.number(-1.25, 1), "−1.3");
  assert.equal(format.number(-0.001, 2), "0.00");
  for (const missing of [null, undefined, NaN, Infinity]) assert.equal(format.number(missing, 2), "–");
});

test("a distance is cut where the second digit of its error is", () => {
  assert.equal(format.distanceText(2.7291, 0.02), "2.729 ± 0.020 m");
  assert.equal(format.distanceText(10.06, 1.3), "10.1 ± 1.3 m");
  assert.equal(format.distanceText(151.2, 34), "151 ± 34 m");
  assert.equal(format.distanceText(1.5, null), "1.500 m");
  assert.equal(format.distanceText(null, 0.1), "–");
});

test("an angle always has its sign", () => {
  assert.deepEqual(
    [format.angle(1.5), format.angle(-1.5, 1), format.angle(0), format.angle(null)],
    ["+1.50°", "−1.5°", "+0.00°", "–"],
  );
});

test("a span is told in the largest unit that still says something", () => {
  assert.deepEqual([-1, 4.25, 12, 89, 90, 5400, 11_000, 200_000].map(format.span), [
    "0.0 s",
    "4.3 s",
    "12 s",
    "89 s",
    "2 min",
    "2 h",
    "3 h",
    "2 days",
  ]);
  assert.equal(format.span(null), "–");
});

test("the time left is no finer than it is known", () => {
  assert.deepEqual([null, 3, 36, 89, 600].map(format.timeLeft), [
    "",
    "a few seconds left",
    "40 s left",
    "90 s left",
    "10 min left",
  ]);
});

test("milliseconds and pixels keep two digits that count", () => {
  assert.deepEqual([0.126, 4.26, 31.4, 12_000].map(format.millis), ["0.13 ms", "4.3 ms", "31 ms", "12 s"]);
  assert.deepEqual([0.00512, 0.0512, 0.21].map(format.pixels), ["0.0051 px", "0.051 px", "0.21 px"]);
  assert.equal(format.baseline(0.2001), "200.1 mm");
});

test("thousands are set apart by a narrow space", () => {
  assert.equal(format.count(12_345), "12\u202f345");
  assert.equal(format.count(null), "–");
});

test("the server's words become a sentence once", () => {
  assert.equal(format.sentence(" no frame for 1 s "), "No frame for 1 s.");
  assert.equal(format.sentence("Is it plugged in?"), "Is it plugged in?");
  assert.equal(format.sentence(null), "");
});

test("a remedy that the detail already has is not said again", () => {
  assert.equal(format.remedyOf({ detail: "no answer", remedy: "plug it in" }), "Plug it in.");
  assert.equal(
    format.remedyOf({ detail: "Ada has control: ask Ada, wait, or take over", remedy: "ask Ada, wait, or take over" }),
    "",
  );
  assert.equal(format.remedyOf(null), "");
});

test("a day and time are written alike everywhere, and nothing where there is none", () => {
  assert.match(format.dayTime("2026-03-04T12:05:59Z"), /2026/);
  assert.doesNotMatch(format.dayTime("2026-03-04T12:05:59Z"), /59/, "seconds are of no use in a list");
  assert.equal(format.dayTime(null), "");
  assert.equal(format.dayTime("soon"), "");
});
