import assert from "node:assert/strict";
import { test } from "node:test";
import {
  distanceOf,
  endedMessage,
  figuresOf,
  followRings,
  marksOf,
  prioritiesWith,
  STATES,
  trailCsv,
  trailFile,
  trailRuns,
} from "../foveacam_web/static/js/looking/follow/words.js";
import { only } from "./documents.js";

/** @param {Partial<import("#api").FollowedDocument>} [fields] @returns {import("#api").FollowedDocument} */
const followed = (fields) =>
  only({
    state: "followed",
    distance_m: 12.3456,
    distance_sigma_m: 0.052,
    speed_m_s: 1.234,
    rate_hz: 3.5,
    age_s: 0.31,
    hits: 9,
    looks: 12,
    ...fields,
  });

/** @type {import("#page").FollowMark} */
const MARK = { id: "a", label: "Car", state: "lost", x_px: 200, y_px: 100 };

/** @param {number} t_s @param {number} z_m @returns {import("#api").TrailPoint} */
const hit = (t_s, z_m) => ({ t_s, x_m: 0, y_m: 0, z_m, distance_sigma_m: 0.02 });

test("a card tells distance, speed, rate and age of the last hit", () => {
  assert.equal(distanceOf(followed()), "12.346 ± 0.052 m");
  assert.deepEqual(figuresOf(followed()), [
    ["Speed", "1.23 m/s"],
    ["Rate", "3.5 hits/s"],
    ["Last hit", "0.3 s ago"],
    ["Hits", "9 of 12"],
  ]);
});

test("what is not known yet is a dash", () => {
  const finding = followed({ distance_m: null, distance_sigma_m: null, speed_m_s: null, age_s: null, looks: 0 });
  assert.equal(distanceOf(finding), "–");
  assert.deepEqual(
    figuresOf(finding).map(([, value]) => value),
    ["–", "3.5 hits/s", "–", "–"],
  );
});

test("a lost target says that it is searched for", () => {
  assert.match(STATES.lost.detail, /searched for/);
  assert.equal(STATES.lost.tone, "warn");
});

test("a priority that is none of the list is listed in its place", () => {
  assert.deepEqual(
    prioritiesWith(1).map(([value]) => value),
    [0.5, 1, 2, 4],
  );
  assert.deepEqual(
    prioritiesWith(3).map(([value]) => value),
    [0.5, 1, 2, 3, 4],
  );
});

test("targets that end together are told in one message, each reason once", () => {
  assert.equal(endedMessage([]), null);
  const stopped = { id: "a", label: "Car", reason: "the stop is engaged" };
  assert.deepEqual(endedMessage([stopped]), {
    tone: "warn",
    title: "“Car” is followed no more",
    detail: "The stop is engaged.",
  });
  assert.deepEqual(endedMessage([stopped, { ...stopped, id: "b", label: "Bus" }]), {
    tone: "warn",
    title: "“Car”, “Bus” are followed no more",
    detail: "The stop is engaged.",
  });
});

test("the marks are those of the overlay message, and where this page asked until the foveae have found it", () => {
  assert.deepEqual(marksOf({ overlay: null, followed: null, follow_asked: {} }), []);
  const sought = followed({ id: "b", label: "Bus", state: "finding" });
  const other = followed({ id: "c", label: "Dog", state: "finding" });
  const state = { overlay: only({ follows: [MARK] }), followed: [sought, other], follow_asked: { b: { x: 5, y: 6 } } };
  assert.deepEqual(marksOf(state), [MARK, { id: "b", label: "Bus", state: "finding", x_px: 5, y_px: 6 }]);
  assert.deepEqual(marksOf({ ...state, overlay: only({ follows: [{ ...MARK, id: "b" }] }) }), [{ ...MARK, id: "b" }]);
  assert.deepEqual(marksOf({ ...state, followed: [] }), [MARK]);
});

test("a mark becomes a ring by its state, whose label does not cover another one", () => {
  const toCss = (/** @type {{x: number, y: number}} */ { x, y }) => ({ x: x / 2, y: y / 2 });
  const near = { ...MARK, id: "b", x_px: 220 };
  const [ring, close, far] = followRings([MARK, near, { ...MARK, id: "c", state: "followed", x_px: 900 }], toCss);
  assert.deepEqual(ring, { kind: "follow lost", x: 100, y: 50, label: "Car", label_y: 32 });
  assert.equal(close?.label_y, 76);
  assert.deepEqual([far?.kind, far?.label_y], ["follow followed", 32]);
});

test("a trail's plot ends at the last hit and has a gap where it was lost", () => {
  assert.deepEqual(trailRuns([]), []);
  const runs = trailRuns([hit(10, 5), hit(11, 6), hit(20, 7)]);
  assert.deepEqual(
    runs.map((run) => run.map(({ x, y }) => [x, y])),
    [
      [
        [-10, 5],
        [-9, 6],
      ],
      [[0, 7]],
    ],
  );
});

test("a trail of rare hits is one line", () => {
  assert.equal(trailRuns([hit(0, 5), hit(6, 5), hit(11, 6), hit(17, 7)]).length, 1);
});

test("a trail is saved as CSV with its distances", () => {
  const text = trailCsv([{ t_s: 1.5, x_m: 3, y_m: 0, z_m: 4, distance_sigma_m: 0.01 }]);
  assert.equal(text, "t_s,x_m,y_m,z_m,distance_m,distance_sigma_m\n1.5000,3.00000,0.00000,4.00000,5.00000,0.01000\n");
  assert.equal(trailFile("Red car / 2"), "trail-Red-car-2.csv");
  assert.equal(trailFile("…"), "trail-target.csv");
});
