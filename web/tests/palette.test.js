import assert from "node:assert/strict";
import { test } from "node:test";
import { fitting } from "../foveacam_web/static/js/panels/palette_words.js";

const ENTRIES = [
  { label: "Gallery", hint: "What was captured and recorded" },
  { label: "Record", hint: "Begin or end a recording" },
  { label: "Red mug" },
];
const names = (/** @type {string} */ typed) => fitting(typed, ENTRIES).map(({ label }) => label);

test("an entry is found by any part of its name or hint, a name first", () => {
  assert.deepEqual(names("rec"), ["Record", "Gallery"]);
  assert.deepEqual(names("MUG"), ["Red mug"]);
  assert.deepEqual(names("mug red"), ["Red mug"]);
  assert.deepEqual(names("red blue"), []);
});

test("nothing typed shows all, in their order", () => {
  assert.deepEqual(names("  "), ["Gallery", "Record", "Red mug"]);
});
