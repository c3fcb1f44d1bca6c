// Places the labels of the marks over a picture: inside the view, and clear of each other. Pure functions.

/**
 * @import { Point } from "#page"
 * @typedef {{width: number, height: number}} Size CSS px
 * @typedef {{left: number, top: number, right: number, bottom: number}} Area CSS px
 * @typedef {{x: number, y: number, anchor: "start" | "end"}} LabelPlace of the text's baseline, CSS px
 */

const LETTER_PX = 6.4; // of the overlay's letters, on average
const ASIDE_PX = 8; // from a mark's middle to its label
const BASELINE_PX = 4; // of a label below its mark's middle
const HEIGHT_PX = 13;

/**
 * Place labels beside their marks, each to the right, or to the left where the right side has no room. A label for
 * which neither side has room is left out, and so is an empty one.
 * @param {{at: Point, text: string}[]} wanted the ones that matter most first
 * @param {Size} view
 * @param {Area[]} [taken] where no label may lie
 * @returns {(LabelPlace | null)[]}
 */
export function placeLabels(wanted, view, taken = []) {
  const full = [...taken];
  return wanted.map(({ at, text }) => {
    const width = text.length * LETTER_PX;
    const places = /** @type {const} */ (["start", "end"]).map((anchor) => placeBeside(at, width, anchor));
    const free = text && places.find(({ area }) => isInside(area, view) && full.every((other) => isApart(area, other)));
    if (!free) return null;
    full.push(free.area);
    return free.place;
  });
}

/** Shorten a long label. @param {string} label */
export function cut(label) {
  return label.length > 28 ? `${label.slice(0, 27)}…` : label;
}

/** @param {Point} at @param {number} width CSS px @param {"start" | "end"} anchor */
function placeBeside({ x, y }, width, anchor) {
  const left = anchor === "start" ? x + ASIDE_PX : x - ASIDE_PX - width;
  const bottom = y + BASELINE_PX;
  return {
    area: { left, top: bottom - HEIGHT_PX, right: left + width, bottom },
    place: { x: anchor === "start" ? x + ASIDE_PX : x - ASIDE_PX, y: bottom, anchor },
  };
}

/** @param {Area} area @param {Size} view */
function isInside({ left, right }, { width }) {
  return left >= 0 && right <= width;
}

/** @param {Area} a @param {Area} b */
function isApart(a, b) {
  return a.right < b.left || b.right < a.left || a.bottom <= b.top || b.bottom <= a.top;
}
