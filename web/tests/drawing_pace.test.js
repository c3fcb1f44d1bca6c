import assert from "node:assert/strict";
import { test } from "node:test";
import { DrawingPace } from "../foveacam_web/static/js/looking/scene/drawing_pace.js";

/** A browser in which each picture takes `picture_ms`, and time passes only in `run`. @param {number} picture_ms */
function browserOf(picture_ms) {
  let [now_ms, last] = [0, 0];
  /** @type {Map<number, {at_ms: number, run: (now_ms: number) => void}>} */
  const waiting = new Map();
  /** @param {number} ms @param {(now_ms: number) => void} run */
  const later = (ms, run) => {
    waiting.set(++last, { at_ms: now_ms + ms, run });
    return last;
  };
  /** @param {number} id */
  const drop = (id) => void waiting.delete(id);
  const clock = {
    request: /** @param {(now_ms: number) => void} draw */ (draw) => later(picture_ms, draw),
    cancel: drop,
    now: () => now_ms,
    wait: /** @param {() => void} run @param {number} ms */ (run, ms) => later(ms, run),
    clear: drop,
  };
  /** @param {number} until_ms */
  const run = (until_ms) => {
    for (;;) {
      const [next] = [...waiting].sort(([, a], [, b]) => a.at_ms - b.at_ms);
      if (!next || next[1].at_ms > until_ms) break;
      waiting.delete(next[0]);
      now_ms = next[1].at_ms;
      next[1].run(now_ms);
    }
    now_ms = until_ms;
  };
  return { clock, run, now: clock.now };
}

/** Change the scene now, which draws for a quarter of a second. @param {DrawingPace} pace @param {() => number} now @param {number[]} drawn_ms */
function change(pace, now, drawn_ms) {
  const end_ms = now() + 250;
  /** @param {number} now_ms */
  const draw = (now_ms) => {
    drawn_ms.push(now_ms);
    if (now_ms < end_ms) pace.request(draw);
  };
  pace.request(draw);
}

/** Times of the drawings after a second change, the first of which told how fast the browser is. @param {number} picture_ms */
function drawings(picture_ms, { touched = false } = {}) {
  const { clock, run, now } = browserOf(picture_ms);
  const pace = new DrawingPace(clock);
  change(pace, now, []);
  run(2000);
  /** @type {number[]} */
  const drawn_ms = [];
  if (touched) pace.touch();
  change(pace, now, drawn_ms);
  run(4000);
  return drawn_ms.map((at_ms) => at_ms - 2000);
}

test("a browser that draws in software draws a change at once, and then six pictures a second", () => {
  const drawn_ms = drawings(33);
  assert.equal(drawn_ms[0], 33);
  assert.ok(drawn_ms.length <= 3, `${drawn_ms}`);
  assert.ok(/** @type {number} */ (drawn_ms.at(-1)) >= 250, "the last picture shows what has settled");
});

test("a browser that draws fast draws every picture", () => {
  assert.ok(drawings(16).length >= 15);
});

test("a view that somebody turns is drawn as often as possible", () => {
  assert.ok(drawings(33, { touched: true }).length >= 7);
});

test("a drawing is cancelled, whether it waits for its turn or for the browser", () => {
  const { clock, run, now } = browserOf(33);
  const pace = new DrawingPace(clock);
  pace.cancel(pace.request(() => assert.fail("the first was cancelled")));
  change(pace, now, []);
  run(300);
  /** @type {number[]} */
  const drawn_ms = [];
  pace.cancel(pace.request(() => assert.fail("the second was cancelled")));
  pace.request((now_ms) => drawn_ms.push(now_ms));
  run(1000);
  assert.equal(drawn_ms.length, 1);
});

test("a drawing that fails does not end the pace", () => {
  const { clock, run, now } = browserOf(33);
  const pace = new DrawingPace(clock);
  pace.request(() => {
    throw new Error("a fault of the scene");
  });
  assert.throws(() => run(40), /a fault of the scene/);
  /** @type {number[]} */
  const drawn_ms = [];
  change(pace, now, drawn_ms);
  run(1000);
  assert.ok(drawn_ms.length > 0);
});
