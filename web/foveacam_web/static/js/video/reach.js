// Shows where both eyes, one eye or none can look: as zones over the wide picture and as text at the pointer.

import { h, s, say } from "../dom.js";
import { number } from "../format.js";

/**
 * @import { ReachDocument } from "#api"
 * @import { Corners, Point } from "#page"
 * @typedef {"both" | "left" | "right" | "none"} Seeing
 */

/** @type {Readonly<Record<Seeing, string>>} */
export const SEEING = Object.freeze({
  both: "both foveae",
  left: "left fovea only",
  right: "right fovea only",
  none: "beyond the mirrors' reach",
});

/**
 * Return which eyes can look at a wide pixel.
 * @param {ReachDocument} reach
 * @param {Point} pixel
 * @returns {Seeing}
 */
export function seeing(reach, pixel) {
  const left = holds(/** @type {Corners} */ (reach.left_px), pixel);
  const right = holds(/** @type {Corners} */ (reach.right_px), pixel);
  return left ? (right ? "both" : "left") : right ? "right" : "none";
}

/**
 * Return whether a closed outline contains a point, by counting the edges that a ray to the right crosses.
 * @param {Corners} outline
 * @param {Point} point
 */
function holds(outline, { x, y }) {
  let inside = false;
  outline.forEach(([x1, y1], index) => {
    const [x2, y2] = outline[(index + 1) % outline.length] ?? [x1, y1];
    if (y1 > y !== y2 > y && x < x1 + ((y - y1) / (y2 - y1)) * (x2 - x1)) inside = !inside;
  });
  return inside;
}

/**
 * Draw the zones as SVG: shaded where one eye or none reaches, clear where both do.
 * @param {ReachDocument} reach
 * @param {(points: Point[]) => string} path of a closed outline
 * @param {Point[]} picture its corners
 */
export function zones(reach, path, picture) {
  const left = path(/** @type {Corners} */ (reach.left_px).map(([x, y]) => ({ x, y })));
  const right = path(/** @type {Corners} */ (reach.right_px).map(([x, y]) => ({ x, y })));
  const whole = path(picture);
  const outside = (/** @type {string} */ id, /** @type {string} */ inner) =>
    s("clipPath", { id }, s("path", { d: `${whole} ${inner}`, "clip-rule": "evenodd" }));
  return [
    outside("reach-not-left", left),
    outside("reach-not-right", right),
    s("path", { class: "beyond", d: `${whole} ${right}`, "fill-rule": "evenodd", "clip-path": "url(#reach-not-left)" }),
    s("path", { class: "one-eye left", d: left, "clip-path": "url(#reach-not-right)" }),
    s("path", { class: "one-eye right", d: right, "clip-path": "url(#reach-not-left)" }),
    s("path", { class: "edge left", d: left }),
    s("path", { class: "edge right", d: right }),
  ];
}

/** The legend of the shades, in the picture's corner. */
export class ReachLegend {
  #where = h("span", { class: "where" });

  constructor() {
    const key = (/** @type {string} */ kind, /** @type {string} */ text) => h("span", { class: `key ${kind}`, text });
    this.element = h(
      "p",
      { class: "reach-legend", hidden: true, title: "Where the mirrors reach, before you click" },
      key("both", "both foveae"),
      key("left", "left only"),
      key("right", "right only"),
      key("none", "none"),
      this.#where,
    );
  }

  /** @param {ReachDocument | null} reach */
  show(reach) {
    this.element.hidden = reach === null;
    if (reach)
      say(
        this.#where,
        reach.distance_m === null ? "far away" : `at ${number(reach.distance_m, reach.distance_m < 10 ? 1 : 0)} m`,
      );
  }
}
