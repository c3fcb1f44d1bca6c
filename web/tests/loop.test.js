import assert from "node:assert/strict";
import { mock, test } from "node:test";
import { LatestOrder } from "../foveacam_web/static/js/transport/latest_order.js";
import { distancePlot, errorPlot, recent } from "../foveacam_web/static/js/looking/loop/plots.js";
import { GROUPS, modeOf, MODES, numberOf, patchOf } from "../foveacam_web/static/js/looking/loop/settings.js";
import {
  detailOf,
  eventMessage,
  figuresOf,
  meetingText,
  STATUSES,
  triggerFigures,
  tuningRows,
  tuningWords,
  whyNotTuned,
} from "../foveacam_web/static/js/looking/loop/words.js";
import { shareOf, valueAt } from "../foveacam_web/static/js/devices/rig/scale.js";
import { only, problem } from "./documents.js";

/** @typedef {import("#api").LoopDocument} LoopDocument */

const VERGE = { low: 0, high: 76 };
/** @type {import("#api").LoopSettingsDocument} */
const SETTINGS = only({
  sensitivity: 0.1,
  correct_for_ms: null,
  most_hz: 20,
  pan: { kp: 0.1, ki: 0.02, kd: 0 },
});

/** @type {LoopDocument["eyes"]} */
const APART = [
  { eye: "left", state: "tracking", x_px: 700, y_px: 500, score: 0.98 },
  { eye: "right", state: "still", x_px: null, y_px: null, score: null },
];

/** @param {Partial<LoopDocument>} [fields] @returns {LoopDocument} */
const loop = (fields) =>
  only({
    running: true,
    status: "tracking",
    detail: "",
    paused: false,
    looks: 9,
    rate_hz: 12.34,
    lead_ms: 33.3,
    axes: [only({ axis: "verge", command_deg: 1.4387 })],
    score_left: 0.841,
    score_right: 0.85,
    fine: true,
    target: { x_px: 1, y_px: 2, state: "tracked", tracker_score: 0.987 },
    trigger: only({ latched: false }),
    eyes: [],
    ...fields,
  });

/** @param {number} look @param {number | null} error_deg @returns {import("#api").LoopSample} */
const sample = (look, error_deg) =>
  only({
    look,
    t_s: 100 + 0.1 * look,
    error_deg: error_deg === null ? null : [error_deg, 0, 2 * error_deg, 0],
    distance_m: error_deg === null ? null : 8,
    distance_sigma_m: error_deg === null ? null : 0.01,
  });

test("a slider of vergence gives a third of its way to the first ten degrees", () => {
  assert.ok(shareOf(VERGE, "root", 10) > 0.36);
  assert.equal(valueAt(VERGE, "root", shareOf(VERGE, "root", 1.44)), 1.44);
  assert.deepEqual([valueAt(VERGE, "root", 0), valueAt(VERGE, "root", 1)], [0, 76]);
  assert.equal(valueAt({ low: 0.01, high: 1 }, "log", 0.5), 0.1);
});

test("a vergence means a distance", () => {
  assert.equal(meetingText(1.4324, 0.2), "8 m");
  assert.equal(meetingText(0, 0.2), "parallel");
  assert.equal(meetingText(1, undefined), "");
});

test("the status has words of the server, and words of the page where nothing is wrong", () => {
  assert.equal(
    detailOf(loop({ status: "low_score", detail: "one eye does not find it" })),
    "One eye does not find it.",
  );
  assert.match(detailOf(loop({ status: "off" })), /^Click in the wide view/);
  assert.equal(detailOf(loop()), "");
  assert.deepEqual([STATUSES.tracking.tone, STATUSES.trigger_fault.tone], ["good", "bad"]);
});

test("the figures tell what is known, and a dash where nothing is", () => {
  assert.deepEqual(figuresOf(loop()), [
    ["Vergence", "1.439°"],
    ["Scores, left and right", "0.84, 0.85"],
    ["Looks", "12.3 /s"],
    ["Lead", "33 ms"],
    ["Target", "tracked, score 0.99"],
    ["Measured by", "both foveae"],
  ]);
  const off = loop({ looks: 0, score_left: null, score_right: null, lead_ms: null, target: null, fine: null });
  assert.deepEqual(
    figuresOf(off).map(([, value]) => value),
    ["–", "–, –", "–", "–", "–", "–"],
  );
});

test("the trigger's failures in a row are told", () => {
  const trigger = only({ exposures: 40, failures: 3, in_a_row: 2, pair_skew_us: -1.2, after_trigger_us: 150.4 });
  assert.deepEqual(triggerFigures({ ...trigger, wide_age_ms: 20.04 }), [
    ["Exposures", "40"],
    ["Failures", "3, 2 in a row"],
    ["Left after right", "−1 µs"],
    ["Pulse to exposure", "150 µs"],
    ["Wide after foveae", "20.0 ms"],
  ]);
});

test("a gain is sent with the other two of its loop, another number alone", () => {
  assert.equal(numberOf(SETTINGS, ["pan", "kp"]), 0.1);
  assert.deepEqual(patchOf(SETTINGS, ["pan", "kp"], 0.5), { pan: { kp: 0.5, ki: 0.02, kd: 0 } });
  assert.deepEqual(patchOf(SETTINGS, "most_hz", null), { most_hz: null });
});

test("never, always and unlimited are modes of a number", () => {
  const modes = MODES["correct_for_ms"]?.modes ?? [];
  assert.deepEqual(
    [null, 0, 500].map((value) => modeOf(modes, value)),
    ["always", "never", "some"],
  );
  assert.equal(modeOf(MODES["most_hz"]?.modes ?? [], 20), "some");
});

test("every number has a unit, a range and a sentence that says what it does", () => {
  for (const { numbers } of GROUPS)
    for (const { unit, span, title } of numbers) {
      assert.notEqual(unit, "");
      assert.ok(span.high > span.low);
      assert.match(title, /^[A-Z].{20,}\.$|: 10 ms at 0\.1\.$/s);
    }
});

test("eyes that are apart have a figure each", () => {
  assert.deepEqual(figuresOf(loop({ status: "split", eyes: APART })), [
    ["Looks", "12.3 /s"],
    ["Left eye", "tracking, score 0.98"],
    ["Right eye", "rests"],
  ]);
});

test("tuning waits for a target, and for a loop that corrects", () => {
  assert.equal(whyNotTuned(loop()), null);
  assert.equal(whyNotTuned(null), "Choose a target first.");
  assert.equal(whyNotTuned(loop({ paused: true })), "The loop is paused.");
  assert.equal(whyNotTuned(loop({ eyes: APART })), "Unite the eyes first.");
  assert.equal(whyNotTuned(loop({ trigger: only({ latched: true }) })), "Reset the trigger first.");
});

test("the job of a tuning says how far it is and why it ended", () => {
  const progress = { done: 4, total: 7, eta_s: 34.8, note: "axes" };
  const job = only({ state: "running", progress, problem: null });
  assert.equal(tuningWords(job), "4 of 7 axes, 35 s left");
  assert.equal(tuningWords({ ...job, progress: { ...progress, total: 0 } }), "begins");
  assert.equal(tuningWords({ ...job, state: "cancelling" }), "being aborted");
  assert.equal(tuningWords({ ...job, state: "succeeded" }), null);
  assert.equal(tuningWords({ ...job, state: "cancelled" }), "Aborted: the gains are as before.");
  const failed = tuningWords({ ...job, state: "failed", problem: problem("the target was lost") });
  assert.equal(failed, "The target was lost. The gains are as before.");
});

test("a tuning's table has a row for each axis, with a dash where no step was made", () => {
  const relay = { amplitude_deg: 0.1, swing_deg: 0.1, period_looks: 2, ultimate_gain: 1.154 };
  const step = { axis: "pan_x", settle_before_ms: null, settle_ms: 412.3, overshoot_before: 0, overshoot: 0.052 };
  const tuned = only({
    relays: [
      { ...relay, axis: "pan_x" },
      { ...relay, axis: "pan_y" },
    ],
    steps: [step],
  });
  assert.deepEqual(tuningRows(tuned), [
    ["Pan x", "not settled", "412 ms", "0 %", "5 %", "1.15", "2.0 looks"],
    ["Pan y", "–", "–", "–", "–", "1.15", "2.0 looks"],
  ]);
});

test("an end on request is told to nobody, one by a fault is", () => {
  const event = only({ kind: "loop.ended", level: "info", message: "the vergence loop has ended: on request" });
  assert.equal(eventMessage(event), null);
  assert.equal(eventMessage({ ...event, level: "warning" })?.title, "The vergence loop ended");
  assert.equal(eventMessage({ ...event, kind: "loop.tuned" })?.tone, "good");
});

test("the curves are of the last 30 s, an axis each, and open where nothing was measured", () => {
  const looks = recent(Array.from({ length: 400 }, (_, look) => sample(look, look > 200 && look < 250 ? null : 0.01)));
  assert.equal(looks[0]?.look, 99);
  const { curves } = errorPlot(looks);
  assert.deepEqual(
    curves.map(({ name, colour, runs }) => [name, colour, runs.length]),
    [
      ["Pan x", "--plan-0", 2],
      ["Pan y", "--plan-1", 2],
      ["Vergence", "--plan-2", 2],
      ["Vertical shift", "--plan-3", 2],
    ],
  );
  assert.equal(curves[2]?.runs[1]?.at(-1)?.y, 0.02);
  assert.ok(curves.every(({ runs }) => runs.every((run) => run.length <= 150)));
  assert.deepEqual(distancePlot([sample(1, 0.1)]).curves[0]?.runs, [[{ x: 0, y: 8, sigma: 0.01 }]]);
});

test("of orders that come while one is obeyed, the newest alone is sent, and none after a refusal", async () => {
  mock.timers.enable({ apis: ["setTimeout"] });
  /** @type {number[]} */
  const sent = [];
  const orders = new LatestOrder({
    pause_ms: 50,
    send: async (/** @type {number} */ order) => {
      sent.push(order);
      return order === 9 ? null : true;
    },
  });
  for (const order of [1, 2, 3]) orders.give(order);
  assert.deepEqual([sent, orders.busy], [[1], true]);
  await passed(50);
  assert.deepEqual(sent, [1, 3]);
  await passed(50);
  assert.equal(orders.busy, false);
  orders.give(9);
  orders.give(10);
  await passed(50);
  assert.deepEqual([sent, orders.busy], [[1, 3, 9], false]);
  mock.timers.reset();
});

/** @param {number} ms */
async function passed(ms) {
  await new Promise(setImmediate);
  mock.timers.tick(ms);
  await new Promise(setImmediate);
}
