// Turns drag, wheel, pinch, double click and keys on a mosaic into calls of its viewer.

/**
 * @import { Point } from "#page"
 * @typedef {{
 *   pan: (dx: number, dy: number) => void, zoom: (at: Point, factor: number) => void, fit: () => void, whole: () => void,
 *   point: (at: Point | null) => void, box: () => {width: number, height: number}
 * }} Meaning `pan`, `zoom`, `point`: CSS px in the element; `whole`: one picture px for one of the screen
 */

const WHEEL_STEP = 0.0015;
const KEY_SHARE = 0.15;
const KEY_ZOOM = 1.5;

/** @param {HTMLElement} element @param {Meaning} mean */
export function listenToHands(element, mean) {
  /** @type {Map<number, Point>} */
  const pointers = new Map();
  const at = (/** @type {MouseEvent} */ event) => {
    const box = element.getBoundingClientRect();
    return { x: event.clientX - box.left, y: event.clientY - box.top };
  };
  element.addEventListener("pointerdown", (event) => {
    if (event.pointerType === "mouse" && event.button > 1) return;
    element.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, at(event));
    mean.point(at(event));
  });
  element.addEventListener("pointermove", (event) => {
    if (pointers.has(event.pointerId)) drag(pointers, event.pointerId, at(event), mean);
    mean.point(at(event));
  });
  const two = (/** @type {TouchEvent} */ event) => event.touches.length > 1 && event.preventDefault(); // they zoom
  element.addEventListener("touchmove", two, { passive: false });
  for (const end of ["pointerup", "pointercancel"]) {
    element.addEventListener(end, (event) => pointers.delete(/** @type {PointerEvent} */ (event).pointerId));
  }
  element.addEventListener(
    "pointerleave",
    (event) => event.pointerType === "mouse" && pointers.size === 0 && mean.point(null),
  );
  element.addEventListener("dblclick", (event) => mean.zoom(at(event), event.shiftKey ? 0.5 : 2));
  element.addEventListener(
    "wheel",
    (event) => {
      event.preventDefault();
      const lines = event.deltaMode === WheelEvent.DOM_DELTA_LINE ? 16 : 1;
      // a trackpad's pinch comes as small wheel steps with Ctrl
      const gain = event.ctrlKey ? 5 * WHEEL_STEP : WHEEL_STEP;
      mean.zoom(at(event), Math.exp(-event.deltaY * lines * gain));
    },
    { passive: false },
  );
  element.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || !pressed(event, mean)) return;
    event.preventDefault();
    event.stopPropagation(); // the console uses some of these keys otherwise
  });
}

/**
 * Pan with one finger or the mouse; with two fingers, keep the picture's points under them.
 * @param {Map<number, Point>} pointers
 * @param {number} id
 * @param {Point} to
 * @param {Meaning} mean
 */
function drag(pointers, id, to, mean) {
  const from = pointers.get(id);
  pointers.set(id, to);
  if (!from) return;
  const other = [...pointers].find(([each]) => each !== id)?.[1];
  if (!other) return mean.pan(to.x - from.x, to.y - from.y);
  const [before, after] = [from, to].map((point) => Math.hypot(point.x - other.x, point.y - other.y));
  mean.pan((to.x - from.x) / 2, (to.y - from.y) / 2);
  if (before && after) mean.zoom({ x: (to.x + other.x) / 2, y: (to.y + other.y) / 2 }, after / before);
}

/** Handle a key; return whether it has a function here. @param {KeyboardEvent} event @param {Meaning} mean */
function pressed({ key, shiftKey }, mean) {
  const { width, height } = mean.box();
  const share = shiftKey ? 5 * KEY_SHARE : KEY_SHARE;
  const middle = { x: width / 2, y: height / 2 };
  /** @type {Record<string, () => void>} */
  const acts = {
    ArrowLeft: () => mean.pan(width * share, 0),
    ArrowRight: () => mean.pan(-width * share, 0),
    ArrowUp: () => mean.pan(0, height * share),
    ArrowDown: () => mean.pan(0, -height * share),
    "+": () => mean.zoom(middle, KEY_ZOOM),
    "=": () => mean.zoom(middle, KEY_ZOOM),
    "-": () => mean.zoom(middle, 1 / KEY_ZOOM),
    0: mean.fit,
    Home: mean.fit,
    1: mean.whole,
  };
  const act = acts[key];
  if (!act) return false;
  act();
  mean.point(middle); // with keys, the readout shows the middle
  return true;
}
