import assert from "node:assert/strict";
import { test } from "node:test";
import {
  displayState,
  patternOf,
  printPath,
  sizeWords,
} from "../foveacam_web/static/js/calibrating/calibration/displays/words.js";
import { isTooLarge, placeOf, screenKey } from "../foveacam_web/static/js/devices/display/scale.js";
import { nameOf, scaleWords, shownWords, warningWords } from "../foveacam_web/static/js/devices/display/words.js";
import { only } from "./documents.js";

const BOARD = only({ pattern: { kind: "checkerboard" }, description: "board", width_mm: 200, height_mm: 150 });
const BLANK = only({ pattern: { kind: "blank" }, description: "blank", width_mm: null, height_mm: null });
const SCREEN = { width_px: 2000, height_px: 1600 };

test("a screen is the same whichever way it is turned", () => {
  assert.equal(screenKey({ width: 800, height: 1280 }), screenKey({ width: 1280, height: 800 }));
  assert.notEqual(screenKey({ width: 800, height: 1280 }), screenKey({ width: 1920, height: 1080 }));
});

test("a pattern has its size times the scale, and its corner is a whole pixel", () => {
  const place = placeOf({ width_mm: 155.7, height_mm: 121.1, ...SCREEN, px_per_mm: 7.37 });
  assert.equal(place.width, 155.7 * 7.37);
  assert.equal(place.height, 121.1 * 7.37);
  assert.ok(Number.isInteger(place.left) && Number.isInteger(place.top));
});

test("a pattern as large as the page fits, a larger one does not", () => {
  assert.equal(isTooLarge({ width_mm: 200, height_mm: 160, ...SCREEN, px_per_mm: 10 }), false);
  assert.equal(isTooLarge({ width_mm: 200.1, height_mm: 160, ...SCREEN, px_per_mm: 10 }), true);
  assert.equal(isTooLarge({ width_mm: 20, height_mm: 160.1, ...SCREEN, px_per_mm: 10 }), true);
});

test("the page says why its pattern is not true, the worst first", () => {
  const all = { shown: BOARD, ...SCREEN, zoom: 1 };
  assert.match(warningWords({ ...all, px_per_mm: null }) ?? "", /not true yet/);
  assert.match(warningWords({ ...all, px_per_mm: 10, zoom: 1.5 }) ?? "", /magnified/);
  assert.match(
    warningWords({ ...all, px_per_mm: 16 }) ?? "",
    /200\.0 × 150\.0 mm are requested, the page has 125\.0 × 100\.0 mm/,
  );
  assert.equal(warningWords({ ...all, px_per_mm: 10 }), null);
  assert.equal(warningWords({ ...all, px_per_mm: 10, shown: BLANK }), null);
});

test("a display says what it shows and its scale", () => {
  assert.equal(shownWords(BOARD), "Board");
  assert.match(shownWords(BLANK), /Blank/);
  assert.equal(scaleWords({ ...SCREEN, px_per_mm: 10 }), "10.000 px/mm · 200 × 160 mm");
  assert.equal(scaleWords({ ...SCREEN, px_per_mm: null }), "Scale not set");
});

test("a display is named by its device", () => {
  assert.equal(nameOf("Mozilla/5.0 (iPad; CPU OS 17_0 like Mac OS X)"), "Display on iPad");
  assert.equal(nameOf("Mozilla/5.0 (Linux; Android 14)"), "Display on Android");
  assert.equal(nameOf("curl"), "Display");
});

test("a print is asked for by the numbers of the pattern and the paper", () => {
  const board = { kind: /** @type {const} */ ("checkerboard"), columns: 9, rows: 6, square_mm: 17.5 };
  assert.equal(
    printPath(board, "A3"),
    "/displays/pattern.pdf?kind=checkerboard&columns=9&rows=6&square_mm=17.5&paper=A3",
  );
});

test("the pattern of the fields has what its kind needs, and none while a field is empty", () => {
  const values = { columns: 9, rows: 6, square_mm: 20, marker_mm: 15, id: null, side_mm: 60, spacing_mm: 100 };
  assert.deepEqual(
    patternOf("checkerboard", (name) => values[name]),
    { kind: "checkerboard", columns: 9, rows: 6, square_mm: 20 },
  );
  assert.equal(
    patternOf("marker", (name) => values[name]),
    null,
  );
});

test("the list says of each display whether it can show the pattern", () => {
  const size = { width_mm: 240, height_mm: 160 };
  assert.deepEqual(displayState(only({ ...size, fits: true })), { tone: "good", text: "240.0 × 160.0 mm" });
  assert.deepEqual(displayState(only({ ...size, fits: null })).tone, "good");
  assert.match(displayState(only({ ...size, fits: false })).text, /does not fit on 240/);
  assert.equal(displayState(only({ width_mm: null, height_mm: null, fits: null })).tone, "warn");
  assert.equal(sizeWords(null, null), "");
});
