import assert from "node:assert/strict";
import { test } from "node:test";
import {
  galleryAddress,
  galleryAt,
  pagesAt,
  planAt,
  wizardAddress,
  wizardAt,
} from "../foveacam_web/static/js/addresses.js";

test("an address opens one page at most", () => {
  const none = {
    wizard: null,
    rig_page: null,
    setup_page: false,
    settings_page: false,
    capture_page: false,
    follow_page: false,
    loop_page: false,
    gallery: null,
    planner_page: false,
    compare_page: false,
    engine_page: false,
    rigs_page: false,
    acceptance_page: false,
    people: null,
  };
  for (const hash of ["", "#/", "#/rigged", "#/capture/1"]) assert.deepEqual(pagesAt(hash), none);
  assert.deepEqual(pagesAt("#/rig"), { ...none, rig_page: "cameras" });
  assert.deepEqual(pagesAt("#/rig/mirrors"), { ...none, rig_page: "mirrors" });
  assert.deepEqual(pagesAt("#/rig/nowhere"), { ...none, rig_page: "cameras" });
  assert.deepEqual(pagesAt("#/setup"), { ...none, setup_page: true });
  assert.deepEqual(pagesAt("#/settings"), { ...none, settings_page: true });
  assert.deepEqual(pagesAt("#/capture"), { ...none, capture_page: true });
  assert.deepEqual(pagesAt("#/follow"), { ...none, follow_page: true });
  assert.deepEqual(pagesAt("#/loop"), { ...none, loop_page: true });
  assert.deepEqual(pagesAt("#/people"), { ...none, people: "people" });
  assert.deepEqual(pagesAt("#/people/log"), { ...none, people: "log" });
  assert.deepEqual(pagesAt("#/people/nowhere"), { ...none, people: "people" });
  assert.deepEqual(pagesAt("#/compare"), { ...none, compare_page: true });
  assert.deepEqual(pagesAt("#/engine"), { ...none, engine_page: true });
  assert.deepEqual(pagesAt("#/rigs"), { ...none, rigs_page: true });
  assert.deepEqual(pagesAt("#/acceptance"), { ...none, acceptance_page: true });
  assert.deepEqual(pagesAt("#/planner?seed=3"), { ...none, planner_page: true });
  assert.deepEqual(pagesAt("#/calibration/fit"), { ...none, wizard: "fit" });
});

test("the planner's address contains the plan", () => {
  assert.equal(planAt("#/planner?seed=3&size_m=4"), "seed=3&size_m=4");
  assert.equal(planAt("#/planner"), "");
  assert.equal(planAt("#/gallery"), null);
});

test("every page of the wizard has an address, and an unknown one leads to the overview", () => {
  for (const page of /** @type {const} */ (["overview", "wide", "mirrors", "fit", "check", "settle"]))
    assert.equal(wizardAt(wizardAddress(page)), page);
  assert.equal(wizardAt("#/calibration/nowhere"), "overview");
  assert.equal(wizardAt("#/rig"), null);
});

test("addresses of the gallery lead back to their place, and those of other pages nowhere", () => {
  assert.deepEqual(galleryAt(galleryAddress("datasets", "a/b ü", "mosaic")), {
    tab: "datasets",
    id: "a/b ü",
    part: "mosaic",
  });
  assert.deepEqual(galleryAt("#/gallery"), { tab: "datasets", id: null, part: null });
  assert.deepEqual(galleryAt("#/gallery/stills/%"), { tab: "stills", id: "%", part: null });
  assert.equal(galleryAt("#/rig"), null);
});
