import assert from "node:assert/strict";
import { test } from "node:test";
import { driverOf, kindOf, pictureOf, stateOf } from "../foveacam_web/static/js/operating/rigs/words.js";

/** @import { RigEntry } from "#api" */

/** @type {RigEntry} */
const RIG = {
  id: "this",
  name: "Bench",
  address: "/",
  source: "this",
  rig_id: "sim-rig120",
  simulated: true,
  scene: "bench",
  state: "ready",
  driver: null,
  problems: [],
  problem: null,
  remedy: null,
  picture_url: "/api/v1/views/wide/snapshot.jpg?scale=2",
};
/** @type {RigEntry} */
const SILENT = { ...RIG, source: "file", rig_id: null, simulated: null, scene: null, state: null };

test("a rig has its state as a badge", () => {
  assert.deepEqual(stateOf(RIG), ["good", "Ready"]);
  assert.deepEqual(stateOf({ ...RIG, state: "degraded" }), ["warn", "Degraded"]);
  assert.deepEqual(stateOf({ ...RIG, state: "of a later version" }), ["warn", "of a later version"]);
  assert.deepEqual(stateOf(SILENT), ["bad", "No answer"]);
});

test("the kind of a rig and how it came to the list are told as far as they are known", () => {
  assert.equal(kindOf(RIG), "sim-rig120 · simulated, scene bench · this server");
  assert.equal(
    kindOf({ ...RIG, simulated: false, scene: null, source: "announced" }),
    "sim-rig120 · hardware · announces itself",
  );
  assert.equal(kindOf(SILENT), "named in the list");
});

test("who drives is told of a rig that answers", () => {
  assert.equal(driverOf(RIG), "Control is free.");
  assert.equal(driverOf({ ...RIG, driver: "ada" }), "ada drives it.");
  assert.equal(driverOf(SILENT), "");
});

test("a picture is loaded anew each time", () => {
  assert.equal(pictureOf(RIG, 2), "/api/v1/views/wide/snapshot.jpg?scale=2&round=2");
  assert.equal(
    pictureOf({ ...RIG, picture_url: "/api/v1/rigs/a/picture.jpg" }, 1),
    "/api/v1/rigs/a/picture.jpg?round=1",
  );
});
