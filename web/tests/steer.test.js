// What steering by hand computes and says, without a browser.

import assert from "node:assert/strict";
import { test } from "node:test";

import * as sticks from "../foveacam_web/static/js/looking/steer/sticks.js";
import * as words from "../foveacam_web/static/js/looking/steer/words.js";
import { only } from "./documents.js";

const LIMITS = { max_v: 170, calibrated: true, shift_limit_deg: 0.5, silent_after_s: 0.25, park_after_s: 3 };

test("a place on a pad is a value, held at its edges", () => {
  assert.deepEqual(words.valueOnPad({ x: 100, y: 100 }, 200, 170), { x: 0, y: 0 });
  assert.deepEqual(words.valueOnPad({ x: 150, y: 50 }, 200, 170), { x: 85, y: -85 });
  assert.deepEqual(words.valueOnPad({ x: -30, y: 999 }, 200, 170), { x: -170, y: 170 });
});

test("arrow keys step, down is larger, and other keys are left alone", () => {
  const pad = { step: 2, most: 170 };
  assert.deepEqual(words.steppedBy({ x: 1, y: 1 }, "ArrowDown", pad), { x: 1, y: 3 });
  assert.deepEqual(words.steppedBy({ x: -169, y: 0 }, "ArrowLeft", pad), { x: -170, y: 0 });
  assert.equal(words.steppedBy({ x: 0, y: 0 }, "Enter", pad), null);
});

test("split, a pad steers its own eye; together, both get the same volts", () => {
  assert.deepEqual(words.voltsFor("right", { x: 5, y: -3 }, true), { right: { x_v: 5, y_v: -3 } });
  const both = words.voltsFor("right", { x: 5, y: -3 }, false);
  assert.deepEqual(both.left, both.right);
});

test("the status says who steers, silence and why it has ended", () => {
  const told = (/** @type {object} */ state) => words.statusWords(only({ by: null, reason: null, ...state }), LIMITS);
  assert.equal(words.statusWords(null, null).tone, "plain");
  assert.equal(told({ status: "steering" }).tone, "good");
  assert.equal(told({ status: "released", by: "Ada" }).text, "Ada steers by hand.");
  assert.match(told({ status: "silent" }).text, /hold, and are parked after 3 s/);
  assert.equal(
    told({ status: "ended", reason: "the stop is engaged" }).text,
    "The stop is engaged. Let go, and press again.",
  );
});

test("a stick in its dead zone steers nothing, and one at its end at full speed", () => {
  assert.deepEqual(sticks.deflection(0.1, -0.1), { x: 0, y: 0 });
  assert.deepEqual(sticks.deflection(NaN, 0), { x: 0, y: 0 });
  assert.deepEqual(sticks.deflection(1, 0), { x: 1, y: 0 });
  const corner = sticks.deflection(1, 1); // a square stick reaches beyond its circle
  assert.ok(Math.abs(Math.hypot(corner.x, corner.y) - 1) < 1e-12);
});

test("the curve is fine near the middle, continuous, and keeps the direction", () => {
  const near = sticks.deflection(0.16, 0);
  assert.ok(near.x > 0 && near.x < 0.001);
  const half = sticks.deflection(0.575, 0); // half way beyond the dead zone
  assert.ok(Math.abs(half.x - 0.25) < 1e-12);
  const slanted = sticks.deflection(0.6, 0.3);
  assert.ok(Math.abs(slanted.y / slanted.x - 0.5) < 1e-12);
});

test("a target is driven by time, up to the edge", () => {
  const how = { speed: 60, most: 170, dt_s: 0.5 };
  assert.deepEqual(sticks.driven({ x: 10, y: 0 }, { x: 1, y: -0.5 }, how), { x: 40, y: -15 });
  assert.deepEqual(sticks.driven({ x: 160, y: 0 }, { x: 1, y: 0 }, how), { x: 170, y: 0 });
});

test("the dead-man is the button A or a shoulder button of the first gamepad that is there", () => {
  const pad = (/** @type {number[]} */ ...pressed) => ({
    connected: true,
    axes: [1, 0, 0, 1],
    buttons: Array.from({ length: 16 }, (_, index) => ({ pressed: pressed.includes(index) })),
  });
  assert.equal(sticks.reading(pad()).held, false);
  assert.equal(sticks.reading(pad(3)).held, false);
  for (const button of [0, 4, 5]) assert.equal(sticks.reading(pad(button)).held, true);
  assert.deepEqual(sticks.reading(pad(0)).right, { x: 0, y: 1 });
  assert.equal(sticks.firstPad([null, { ...pad(), connected: false }]), null);
  assert.equal(sticks.firstPad([null, pad()])?.connected, true);
});
