import assert from "node:assert/strict";
import { test } from "node:test";
import * as angles from "../foveacam_web/static/js/video/angles.js";
import { EyesStay } from "../foveacam_web/static/js/video/eyes_stay.js";
import { HEADER_BYTES, jpegOf, readHeader, socketUrl } from "../foveacam_web/static/js/video/protocol.js";
import { placeLabels } from "../foveacam_web/static/js/video/labels.js";
import { seeing } from "../foveacam_web/static/js/video/reach.js";
import { sufficientScale, Viewport } from "../foveacam_web/static/js/video/viewport.js";
import { LENS, only } from "./documents.js";

const FIELD = { ax_min_deg: -10, ax_max_deg: 10, ay_min_deg: -8, ay_max_deg: 8 };

/**
 * @param {number} found
 * @param {number} wanted
 * @param {number} tolerance
 */
function near(found, wanted, tolerance) {
  assert.ok(Math.abs(found - wanted) <= tolerance, `${found} is not within ${tolerance} of ${wanted}`);
}

test("the axis of the lens is the direction straight ahead", () => {
  const { ax_deg, ay_deg } = angles.directionOf(LENS, { x: LENS.cx_px, y: LENS.cy_px });
  near(ax_deg, 0, 1e-12);
  near(ay_deg, 0, 1e-12);
});

test("a lens without distortion is a pinhole", () => {
  const { ax_deg, ay_deg } = angles.directionOf(
    { ...LENS, distortion: [] },
    { x: LENS.cx_px + LENS.fx_px, y: LENS.cy_px },
  );
  near(ax_deg, 45, 1e-12);
  near(ay_deg, 0, 1e-12);
});

/** Pixel and direction by cv2.undistortPoints, iterated to 1e-12. */
const BY_OPENCV = [
  { x: 0, y: 0, ax_deg: -12.949484566, ay_deg: -9.729395204 },
  { x: 1439, y: 1079, ax_deg: 12.847752671, ay_deg: 9.76968411 },
  { x: 720, y: 540, ax_deg: -0.045328876, ay_deg: 0.031750301 },
  { x: 1200.25, y: 80.5, ax_deg: 8.627799896, ay_deg: -8.277165206 },
];

test("pixels have the directions that OpenCV gives them, and lead back", () => {
  for (const { x, y, ...direction } of BY_OPENCV) {
    const found = angles.directionOf(LENS, { x, y });
    near(found.ax_deg, direction.ax_deg, 1e-7);
    near(found.ay_deg, direction.ay_deg, 1e-7);
    const back = angles.pixelOf(LENS, found);
    near(back.x, x, 1e-6);
    near(back.y, y, 1e-6);
  }
});

test("the outline of the steerable field goes through its corners", () => {
  const outline = angles.fieldOutline(LENS, FIELD, 4);
  assert.equal(outline.length, 16);
  assert.deepEqual(outline[0], angles.pixelOf(LENS, { ax_deg: -10, ay_deg: -8 }));
  assert.deepEqual(outline[8], angles.pixelOf(LENS, { ax_deg: 10, ay_deg: 8 }));
  assert.deepEqual(
    [angles.inField(FIELD, { ax_deg: 10, ay_deg: 0 }), angles.inField(FIELD, { ax_deg: 0, ay_deg: 9 })],
    [true, false],
  );
});

test("a wide pixel is seen by both eyes, by one or by none", () => {
  const box = (/** @type {number} */ x0, /** @type {number} */ x1) => [
    [x0, 0],
    [x1, 0],
    [x1, 100],
    [x0, 100],
  ];
  const reach = /** @type {import("#api").ReachDocument} */ (only({ left_px: box(0, 60), right_px: box(40, 100) }));
  assert.deepEqual(
    [50, 20, 80, 120].map((x) => seeing(reach, { x, y: 50 })),
    ["both", "left", "right", "none"],
  );
});

/** @param {number} [device_px] */
function viewport(device_px = 1) {
  const view = new Viewport(1440, 1080);
  view.resize({ width: 720, height: 600, left: 10.3, top: 20.7 }, device_px);
  return view;
}

test("a picture fits its box, and its first pixel has its centre at (0, 0)", () => {
  const view = viewport();
  assert.equal(view.scale, 0.5);
  const { x, y } = view.origin;
  assert.deepEqual(view.toSensor({ x: x + 0.25, y: y + 0.25 }), { x: 0, y: 0 });
  assert.deepEqual(
    [view.holds({ x: -0.5, y: 0 }), view.holds({ x: -0.6, y: 0 }), view.holds({ x: 1439.6, y: 0 })],
    [true, false, false],
  );
});

test("the corner of a picture lies on a device pixel, however it was zoomed and moved", () => {
  const view = viewport(0.5);
  view.zoomAt({ x: 300, y: 200 }, 3.7);
  view.pan(12.34, -5.67);
  const { x, y } = view.origin;
  for (const at of [x + 10.3, y + 20.7]) near(at / 0.5, Math.round(at / 0.5), 1e-9);
});

test("what lies under the pointer stays there while it is magnified", () => {
  const view = viewport(0.001);
  const before = view.toSensor({ x: 300, y: 250 });
  view.zoomAt({ x: 300, y: 250 }, 4);
  const after = view.toSensor({ x: 300, y: 250 });
  near(after.x, before.x, 0.002);
  near(after.y, before.y, 0.002);
  const css = view.toCss(after);
  near(css.x, 300, 1e-9);
});

test("a picture is magnified to 48 CSS pixels a pixel at most, and never made smaller than its box", () => {
  const view = viewport();
  view.zoomAt({ x: 300, y: 250 }, 1e6);
  near(view.scale, 48, 1e-9);
  view.zoomAt({ x: 300, y: 250 }, 1e-6);
  assert.equal(view.zoom, 1);
});

test("a magnified picture is not moved out of its box, and shows a pixel that is to be revealed", () => {
  const view = viewport();
  view.zoomAt({ x: 360, y: 300 }, 4);
  view.pan(1e6, 1e6);
  near(view.origin.x, 0, 1);
  view.reveal({ x: 1400, y: 900 }, 40);
  const { x, y } = view.toCss({ x: 1400, y: 900 });
  assert.ok(x <= 681 && x >= 39 && y <= 561 && y >= 39, `${x}, ${y}`);
});

test("the header of a frame is read in little-endian, and the rest is its JPEG", () => {
  const message = new ArrayBuffer(HEADER_BYTES + 3);
  const bytes = new DataView(message);
  bytes.setUint8(0, 2);
  bytes.setUint8(1, 1);
  bytes.setUint16(2, 1, true);
  bytes.setUint32(4, 70_000, true);
  bytes.setBigUint64(8, 123_456_789_012n, true);
  bytes.setUint32(16, 4200, true);
  bytes.setUint8(20, 2);
  assert.deepEqual(readHeader(message), {
    view: 2,
    scale: 1,
    frozen: true,
    seq: 70_000,
    t_capture_us: 123_456_789_012n,
    age_us: 4200,
    binning: 2,
  });
  assert.equal(jpegOf(message).size, 3);
  assert.throws(() => readHeader(new ArrayBuffer(HEADER_BYTES)), /shorter than its header of 24/);
});

test("the socket of a page is at its own origin, encrypted as the page is", () => {
  assert.equal(socketUrl("http://127.0.0.1:8000/#/rig"), "ws://127.0.0.1:8000/api/v1/views/ws");
  assert.equal(socketUrl("https://rig.example/"), "wss://rig.example/api/v1/views/ws");
});

test("a pane asks for the smallest picture that looks as sharp as the full one", () => {
  const asked = (/** @type {number} */ device_width) => sufficientScale(device_width, 1440);
  assert.deepEqual([322, 396, 397, 644, 792, 793, 1440].map(asked), [4, 4, 2, 2, 2, 1, 1]);
});

test("a pixel of a scaled picture is the middle of its sensor pixels", () => {
  // a canvas of 360 pixels over 1440 sensor pixels, in a box of 720 CSS pixels
  const viewport = new Viewport(1440, 1080);
  viewport.resize({ width: 720, height: 540, left: 0, top: 0 }, 1);
  const places = [
    { index: 0, sensor: 1.5 },
    { index: 7, sensor: 29.5 },
    { index: 359, sensor: 1437.5 },
  ];
  for (const { index, sensor } of places) {
    near(viewport.toSensor({ x: (index + 0.5) * 2, y: 1 }).x, sensor, 1e-9);
  }
});

test("the eyes stay where a fixation left them until an overlay shows them elsewhere", () => {
  const stay = new EyesStay();
  /** @param {string | null} id @param {number | null} ax_deg */
  const state = (id, ax_deg) => {
    const eye = ax_deg === null ? null : { ax_deg, ay_deg: 1 };
    return only({
      current: id && { fixation: { id, created_utc: new Date().toISOString(), duration_ms: 900, steps: [] } },
      overlay: { gaze: { left: eye, right: { ax_deg: 5, ay_deg: 1 } } },
    });
  };
  assert.equal(stay.update(state("fix-1", 0), 0), true);
  assert.equal(stay.update(state("fix-1", 4), 300), true); // on their way
  assert.equal(stay.update(state("fix-1", 4.02), 1000), true);
  assert.equal(stay.update(state("fix-1", 7), 1100), false);
  assert.equal(stay.update(state("fix-1", null), 1200), false);
  assert.equal(stay.update(state("fix-1", 4), 1300), true); // looked at again
  assert.equal(stay.update(state("fix-2", 7), 1400), true);
  assert.equal(stay.update(state("fix-2", 7.5), 2200), false);
  assert.equal(stay.update(state("fix-2", 7), 2300), true);
  assert.equal(stay.update(only({ current: null, overlay: null }), 2400), true);
});

test("a page that hears of an earlier fixation compares with where that looked", () => {
  const steps = [
    { left_ax_deg: 0, left_ay_deg: 0, right_ax_deg: 0, right_ay_deg: 0 },
    { left_ax_deg: 9, left_ay_deg: 1, right_ax_deg: 5, right_ay_deg: 1 },
  ];
  const fixation = { id: "fix-1", created_utc: "2026-01-01T00:00:00Z", duration_ms: 500, steps };
  const at = (/** @type {number} */ ax_deg) =>
    only({
      current: { fixation },
      overlay: { gaze: { left: { ax_deg, ay_deg: 1 }, right: { ax_deg: 5, ay_deg: 1 } } },
    });
  assert.equal(new EyesStay().update(at(9.02), 0), true);
  assert.equal(new EyesStay().update(at(3), 0), false);
});

test("a label lies beside its mark, on the other side where the view ends, and never over another one", () => {
  const view = { width: 300, height: 200 };
  const first = { at: { x: 50, y: 50 }, text: "Target 1" };
  const close = { at: { x: 70, y: 55 }, text: "Target 2" };
  const last = { at: { x: 280, y: 100 }, text: "Target 3" };
  const nameless = { at: { x: 150, y: 150 }, text: "" };
  const places = placeLabels([first, close, last, nameless], view);
  assert.deepEqual(places[0], { x: 58, y: 54, anchor: "start" });
  assert.equal(places[1], null, "on either side it would lie over the first label");
  assert.deepEqual(places[2], { x: 272, y: 104, anchor: "end" });
  assert.equal(places[3], null);
});

test("a label keeps clear of what is written already", () => {
  const view = { width: 300, height: 200 };
  const mark = { at: { x: 150, y: 100 }, text: "Target 1" };
  const right = { left: 155, top: 90, right: 250, bottom: 110 };
  assert.equal(placeLabels([mark], view, [right])[0]?.anchor, "end");
  assert.equal(placeLabels([mark], view, [{ ...right, left: 60 }])[0], null);
  assert.equal(placeLabels([mark], view, [{ ...right, top: 110, bottom: 130 }])[0]?.anchor, "start");
});
