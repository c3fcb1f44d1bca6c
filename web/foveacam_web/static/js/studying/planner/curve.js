// Plots the probability of success over D_max, with the current D_max and the slope there.

import { fill, h, s } from "../../elements/dom.js";
import { plainly } from "../../devices/rig/scale.js";
import { ticksTo } from "./geometry.js";
import { chance, length } from "./words.js";

/** @import { StandoffDocument } from "#api" */

const WIDTH = 420;
const HEIGHT = 240;
const BOX = Object.freeze({ left: 50, top: 14, right: WIDTH - 12, bottom: HEIGHT - 38 });

/** @returns {{element: HTMLElement, show: (document: StandoffDocument, stale: boolean) => void}} */
export function makeCurve() {
  const svg = s("svg", { class: "success-curve", viewBox: `0 0 ${WIDTH} ${HEIGHT}`, role: "img" });
  const element = h(
    "div",
    { class: "curve" },
    svg,
    h(
      "p",
      { class: "legend" },
      h("span", { class: "key success", text: "P_succ (Eq. 12)" }),
      h("span", { class: "key slope", text: "slope at D_max (Eq. 13)" }),
    ),
  );
  return {
    element,
    show: (document, stale) => {
      element.classList.toggle("stale", stale);
      svg.setAttribute(
        "aria-label",
        `Probability of success ${chance(document.success)} at D_max of ${length(document.ring.d_max_m)}`,
      );
      fill(svg, ...draw(document));
    },
  };
}

/** @param {StandoffDocument} document */
function draw({ curve, ring, success, success_slope_per_m: slope }) {
  const last_m = curve.d_max_m[curve.d_max_m.length - 1] ?? 1;
  const top = topOf(Math.max(...curve.success, success));
  const x = (/** @type {number} */ value_m) => BOX.left + ((BOX.right - BOX.left) * value_m) / last_m;
  const y = (/** @type {number} */ share) => BOX.bottom - ((BOX.bottom - BOX.top) * share) / top;
  const line = (/** @type {number[]} */ values) =>
    values
      .map(
        (value, index) => `${index === 0 ? "M" : "L"}${x(curve.d_max_m[index] ?? 0).toFixed(1)} ${y(value).toFixed(1)}`,
      )
      .join("");
  const shown = ring.d_max_m <= last_m;
  return [
    s(
      "defs",
      {},
      s(
        "clipPath",
        { id: "curve-frame" },
        s("rect", { x: BOX.left, y: BOX.top, width: BOX.right - BOX.left, height: BOX.bottom - BOX.top }),
      ),
    ),
    ...axes(last_m, top, x, y),
    s(
      "g",
      { "clip-path": "url(#curve-frame)" },
      s("line", { class: "near", x1: x(ring.inner_m), x2: x(ring.inner_m), y1: BOX.top, y2: BOX.bottom }),
      s("path", { class: "success", d: line(curve.success) }),
      shown &&
        !ring.empty &&
        s("line", { class: "slope", ...tangent({ at_m: ring.d_max_m, success, slope, reach_m: 0.22 * last_m }, x, y) }),
    ),
    ring.inner_m < 0.92 * last_m &&
      s("text", { class: "name", x: x(ring.inner_m) + 4, y: BOX.top + 10, text: "nearest" }),
    shown && s("circle", { class: "now", cx: x(ring.d_max_m), cy: y(success), r: 5 }),
  ].filter((each) => each !== false);
}

/**
 * @param {number} last_m
 * @param {number} top
 * @param {(value: number) => number} x
 * @param {(value: number) => number} y
 */
function axes(last_m, top, x, y) {
  const across = ticksTo(last_m).flatMap((tick) => [
    s("line", { class: "grid", x1: x(tick), x2: x(tick), y1: BOX.top, y2: BOX.bottom }),
    s("text", { class: "tick", x: x(tick), y: BOX.bottom + 14, "text-anchor": "middle", text: plainly(tick) }),
  ]);
  const up = ticksTo(top).flatMap((tick) => [
    s("line", { class: "grid", x1: BOX.left, x2: BOX.right, y1: y(tick), y2: y(tick) }),
    s("text", { class: "tick", x: BOX.left - 6, y: y(tick) + 4, "text-anchor": "end", text: plainly(tick) }),
  ]);
  return [
    ...across,
    ...up,
    s("text", {
      class: "name",
      x: (BOX.left + BOX.right) / 2,
      y: HEIGHT - 6,
      "text-anchor": "middle",
      text: "D_max, m",
    }),
    s("text", {
      class: "name",
      x: 12,
      y: (BOX.top + BOX.bottom) / 2,
      "text-anchor": "middle",
      transform: `rotate(-90 12 ${(BOX.top + BOX.bottom) / 2})`,
      text: "probability",
    }),
  ];
}

/**
 * @param {{at_m: number, success: number, slope: number, reach_m: number}} point
 * @param {(value: number) => number} x
 * @param {(value: number) => number} y
 */
function tangent({ at_m, success, slope, reach_m }, x, y) {
  const end = (/** @type {number} */ side) => ({ x: x(at_m + side * reach_m), y: y(success + side * reach_m * slope) });
  const [from, to] = [end(-1), end(1)];
  return { x1: from.x, y1: from.y, x2: to.x, y2: to.y };
}

/** Return the end of the axis: a little above the highest value, 1 at most. @param {number} highest */
function topOf(highest) {
  return highest <= 0 ? 1 : Math.min(1, 1.15 * highest);
}
