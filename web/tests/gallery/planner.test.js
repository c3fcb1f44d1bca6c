import assert from "node:assert/strict";
import { test } from "node:test";
import { blamed, unfilled } from "../../foveacam_web/static/js/studying/planner/blame.js";
import * as geometry from "../../foveacam_web/static/js/studying/planner/geometry.js";
import { Newest } from "../../foveacam_web/static/js/studying/planner/newest.js";
import { readPlan, written } from "../../foveacam_web/static/js/studying/planner/settings.js";
import { area, chance, length, sightWords } from "../../foveacam_web/static/js/studying/planner/words.js";
import { problem } from "../documents.js";

const told = (/** @type {string} */ detail) => blamed(problem(detail)).map(({ place, words }) => [place, words]);

test("a refusal is told beside the field that it is about", () => {
  assert.deepEqual(told("clutter.occupancy is 2; needed is a value of at most 1."), [
    ["occupancy", "2 was given; needed is a value of at most 1."],
  ]);
  assert.deepEqual(told("ring.d_min_m is -3; needed is a value of at least 0."), [
    ["d_min_m", "-3 was given; needed is a value of at least 0."],
  ]);
  assert.deepEqual(told("a domain of 10 m² is smaller than the ring."), [
    ["domain_m2", "a domain of 10 m² is smaller than the ring; give more, or let it follow the ring"],
  ]);
  assert.deepEqual(told("target 1 at 0, 0 is inside obstacle 0."), [
    ["targets", "target 1 at 0, 0 is inside obstacle 0."],
  ]);
  assert.deepEqual(told("something else."), [[null, "something else."]]);
  assert.deepEqual(blamed(null), []);
});

test("two refusals are told apart", () => {
  const both = told("ring.pixels is x; needed is a number. ring.feature_mm is y; needed is a number.");
  assert.deepEqual(
    both.map(([place]) => place),
    ["pixels", "feature_mm"],
  );
});

test("an empty field is named, the domain only where it is the user's own", () => {
  const { settings } = readPlan("");
  const empty = { ...settings, feature_mm: NaN, domain_m2: NaN };
  assert.deepEqual(unfilled(empty)[0], { place: "feature_mm", words: "Feature size S is empty: type in a number" });
  assert.deepEqual(
    unfilled(empty).map(({ place }) => place),
    ["feature_mm", "domain_m2"],
  );
  assert.deepEqual(
    unfilled({ ...empty, own_domain: false }).map(({ place }) => place),
    ["feature_mm"],
  );
});

test("an address holds what differs from the first plan, and gives it back", () => {
  assert.equal(written(readPlan("")), "");
  const address = "pixels=20&bound=plain&domain_m2=ring&map=open&at=1.5,2;-3,4";
  const plan = readPlan(address);
  assert.equal(written(plan), address);
  assert.deepEqual(
    [plan.settings.pixels, plan.settings.own_domain, plan.targets_m],
    [
      20,
      false,
      [
        [1.5, 2],
        [-3, 4],
      ],
    ],
  );
});

test("what an address tells in no number is as at first", () => {
  const plan = readPlan("pixels=many&seed=&map=moon&bound=none&at=1,2;3");
  assert.deepEqual(plan, readPlan(""));
});

test("a sheet has y up on the ground and down on the drawing, and leads back", () => {
  const sheet = new geometry.Sheet({ x0: -10, y0: 0, x1: 10, y1: 10 }, { width: 400, height: 400 });
  assert.deepEqual(sheet.toDrawing([-10, 10]), { x: 0, y: 100 });
  assert.deepEqual(sheet.toGround(sheet.toDrawing([3, 7])), [3, 7]);
  assert.equal(
    sheet.path([
      [
        [0, 0],
        [1, 0],
        [0, 1],
      ],
      [],
    ]),
    "M200.00 300.00L220.00 300.00L200.00 280.00Z",
  );
});

test("a place in a hole is outside a surface", () => {
  const square = (/** @type {number} */ half) =>
    /** @type {import("#page").MapPoint[]} */ ([
      [-half, -half],
      [half, -half],
      [half, half],
      [-half, half],
    ]);
  const outlines = geometry.outlinesOf({
    type: "GeometryCollection",
    geometries: [{ type: "Polygon", coordinates: [square(2), square(1)] }, { type: "Point" }],
  });
  assert.deepEqual(
    [
      [1.5, 0],
      [0, 0],
      [3, 0],
    ].map(([x = 0, y = 0]) => geometry.holds(outlines, [x, y])),
    [true, false, false],
  );
});

test("features are found by their kind", () => {
  const feature = { type: "Feature", geometry: null, properties: { kind: "region" } };
  assert.deepEqual(geometry.featuresOf({ type: "FeatureCollection", features: [feature] }, "region"), [feature]);
  assert.deepEqual(geometry.featuresOf(null, "region"), []);
});

test("lengths and ticks are round", () => {
  assert.deepEqual([0.7, 1, 3, 49].map(geometry.niceLength), [0.5, 1, 2, 20]);
});

test("areas, lengths and chances are read with the digits that count", () => {
  assert.deepEqual([99.94, 12_345.6].map(area), ["99.9 m²", "12\u202f346 m²"]);
  assert.deepEqual([14.3783, 28.7567].map(length), ["14.38 m", "28.76 m"]);
  assert.deepEqual([0, 0.00123, 0.5].map(chance), ["0.000", "0.0012", "0.500"]);
});

test("the readout says which targets are in sight", () => {
  assert.equal(sightWords([1, -2], [], 2), "x 1.0, y −2.0 m: no target is seen unnoticed from here.");
  assert.equal(sightWords([1, 2], [0], 2), "x 1.0, y 2.0 m: 1 of 2 in sight (target 0).");
  assert.equal(sightWords([1, 2], [0, 1], 2), "x 1.0, y 2.0 m: 2 of 2 in sight (targets 0, 1).");
});

test("of what is asked while an answer is awaited only the newest is sent", async (context) => {
  /** @type {{body: unknown, answer: (response: Response) => void}[]} */
  const sent = [];
  context.mock.method(
    globalThis,
    "fetch",
    (/** @type {string} */ _, /** @type {RequestInit} */ { body }) =>
      new Promise((answer) => sent.push({ body: JSON.parse(String(body)), answer })),
  );
  const settled = () => new Promise((resolve) => setImmediate(resolve));
  /** @type {Newest<{n: number}>} */
  const newest = new Newest("/plans", () => {});
  for (const n of [1, 2, 3]) newest.want({ n });
  assert.deepEqual([sent.map(({ body }) => body), newest.answer.stale], [[{ n: 1 }], true]);
  sent[0]?.answer(Response.json({ n: 1 }));
  await settled();
  assert.deepEqual(
    [sent.map(({ body }) => body), newest.answer],
    [[{ n: 1 }, { n: 3 }], { stale: true, document: { n: 1 }, problem: null }],
  );
  sent[1]?.answer(
    Response.json(
      { title: "Refused", status: 422, type: "/problems/out-of-range", detail: "too far" },
      { status: 422 },
    ),
  );
  await settled();
  const { stale, document, problem: refusal } = newest.answer;
  assert.deepEqual([stale, document, refusal?.detail], [false, { n: 1 }, "too far"]); // what was answered before stays
});
