// Draws over the wide picture: footprints, steerable field, targets, what is followed, the rectangle, the crosshair.
// It draws in CSS pixels through the viewport, so that lines and letters keep their size at any zoom.

import { estimateText } from "../looking/answers.js";
import { fill, h, html, s, setText, svg } from "../elements/dom.js";
import { followRings, marksOf, RING_PX } from "../looking/follow/words.js";
import { number } from "../elements/format.js";
import { hasEnded } from "../transport/jobs.js";
import { fieldOutline } from "./angles.js";
import { cut } from "./labels.js";
import { targetMarks } from "./target_marks.js";

/**
 * @import { ReachDocument } from "#api"
 * @import { ConsoleState, Corners, CurrentFixation, Point } from "#page"
 * @import { Viewport } from "./viewport.js"
 * @typedef {{x: number, y: number, width: number, height: number}} Box
 */

/** The overlay of one surface. */
export class Overlay {
  #field = s("g", { class: "field" });
  #prints = s("g", { class: "footprints" });
  #marks = s("g", { class: "marks" });
  #follows = s("g", { class: "follows" });
  #aim = s("g", { class: "aim" });
  /** What the layers that may change with every frame show. @type {Map<Element, string>} */
  #shown = new Map();
  /** @type {Box | null} */
  #rectangle = null;
  /** @type {Point | null} */
  #cross = null;

  constructor() {
    this.element = s(
      "svg",
      { class: "overlay", "aria-hidden": "true" },
      this.#field,
      this.#prints,
      this.#marks,
      this.#follows,
      this.#aim,
    );
  }

  /** @param {Viewport} viewport @param {ConsoleState} state */
  draw(viewport, state) {
    this.drawField(viewport, state);
    this.drawFootprints(viewport, state);
    this.drawMarks(viewport, state);
    this.drawFollows(viewport, state);
    this.#drawAim(viewport);
  }

  /** @param {Viewport} viewport @param {ConsoleState} state */
  drawField(viewport, { rig, intrinsics, reach, settings }) {
    if (settings.field && reach) {
      const picture = corners({ x: -0.5, y: -0.5, width: viewport.width, height: viewport.height });
      return fill(this.#field, ...zones(reach, (points) => path(points, viewport), picture));
    }
    if (!settings.field || !rig?.steering || !intrinsics) return fill(this.#field);
    const inner = path(fieldOutline(intrinsics, rig.steering), viewport);
    const outer = path(corners({ x: -0.5, y: -0.5, width: viewport.width, height: viewport.height }), viewport);
    fill(
      this.#field,
      svg`<path class="beyond" d="${outer} ${inner}" fill-rule="evenodd"></path>`,
      svg`<path class="edge" d=${inner}></path>`,
    );
  }

  /** @param {Viewport} viewport @param {ConsoleState} state */
  drawFootprints(viewport, { overlay, settings }) {
    const prints = settings.footprints && overlay ? overlay.footprints : null;
    if (!this.#changes(this.#prints, [prints, viewport.origin, viewport.scale])) return;
    const eyes = /** @type {const} */ (["left", "right"]);
    fill(
      this.#prints,
      ...eyes.flatMap((eye) => {
        const points = prints?.[eye]?.map(([x, y]) => ({ x, y }));
        return points && points.length > 2 ? footprint(eye, points, viewport) : [];
      }),
    );
  }

  /**
   * Return whether a layer's content has changed: only then are its elements rebuilt and drawn.
   * @param {Element} layer
   * @param {unknown} content
   */
  #changes(layer, content) {
    const text = JSON.stringify(content);
    if (this.#shown.get(layer) === text) return false;
    this.#shown.set(layer, text);
    return true;
  }

  /** @param {Viewport} viewport @param {ConsoleState} state */
  drawMarks(viewport, state) {
    const request = state.current?.request ?? null;
    fill(this.#marks, ...targetMarks(state, viewport), ...asked(request, viewport), estimated(state.current, viewport));
  }

  /** @param {Viewport} viewport @param {ConsoleState} state */
  drawFollows(viewport, state) {
    const rings = followRings(state.settings.marks ? marksOf(state) : [], (at) => viewport.toCss(at));
    if (!this.#changes(this.#follows, rings)) return;
    fill(
      this.#follows,
      ...rings.map(
        ({ kind, x, y, label, label_y }) => svg`<g class=${kind}>
          <circle class="under" cx=${x} cy=${y} r=${RING_PX}></circle>
          <circle cx=${x} cy=${y} r=${RING_PX}></circle>
          <text x=${x} y=${label_y} text-anchor="middle">${cut(label)}</text>
        </g>`,
      ),
    );
  }

  /** @param {Viewport} viewport @param {Box | null} box sensor px */
  showRectangle(viewport, box) {
    this.#rectangle = box;
    this.#drawAim(viewport);
  }

  /** @param {Viewport} viewport @param {Point | null} at sensor px */
  showCross(viewport, at) {
    this.#cross = at;
    this.#drawAim(viewport);
  }

  /** @param {Viewport} viewport */
  #drawAim(viewport) {
    const box = this.#rectangle && s("path", { class: "rectangle", d: path(corners(this.#rectangle), viewport) });
    fill(this.#aim, box, this.#cross && cross(viewport.toCss(this.#cross), "cross", 9));
  }
}

/** @param {"left" | "right"} eye @param {Point[]} points @param {Viewport} viewport */
function footprint(eye, points, viewport) {
  const places = points.map((point) => viewport.toCss(point));
  const lowest = Math.max(...places.map(({ y }) => y));
  const side = eye === "left" ? Math.min(...places.map(({ x }) => x)) : Math.max(...places.map(({ x }) => x));
  return [
    svg`<path class="print-shadow" d=${path(points, viewport)}></path>`,
    svg`<path class="print ${eye}" d=${path(points, viewport)}></path>`,
    svg`<text class="print-name ${eye}" x=${side} y=${lowest + 13} text-anchor=${eye === "left" ? "start" : "end"}>
      ${eye === "left" ? "L" : "R"}
    </text>`,
  ];
}

/**
 * Draw the last request at its position.
 * @param {import("#api").FixationRequest | null} request
 * @param {Viewport} viewport
 */
function asked(request, viewport) {
  if (!request) return [];
  if (request.pixel) {
    return [cross(viewport.toCss({ x: request.pixel.x_px, y: request.pixel.y_px }), "asked", 12)];
  }
  if (!request.rectangle) return [];
  const { x_px, y_px, width_px, height_px } = request.rectangle;
  const box = { x: x_px, y: y_px, width: width_px, height: height_px };
  return [svg`<path class="asked-box" d=${path(corners(box), viewport)}></path>`];
}

/**
 * Write what is known of the running fixation's distance beside its cross.
 * @param {CurrentFixation | null} current
 * @param {Viewport} viewport
 */
function estimated(current, viewport) {
  const place = current?.request?.pixel;
  const known = current && !current.fixation && !hasEnded(current.state) ? estimateText(current.estimate) : "";
  if (!place || !known) return null;
  const { x, y } = viewport.toCss({ x: place.x_px, y: place.y_px });
  return svg`<g class="mark estimate"><text x=${x + 14} y=${y - 8}>${known}</text></g>`;
}

/** @param {Point} at @param {string} kind @param {number} reach */
function cross({ x, y }, kind, reach) {
  const gap = reach / 3;
  const arms = `M${x - reach} ${y}H${x - gap}M${x + gap} ${y}H${x + reach}M${x} ${y - reach}V${y - gap}M${x} ${y + gap}V${y + reach}`;
  return svg`<g class=${kind}><path class="under" d=${arms}></path><path d=${arms}></path></g>`;
}

/** @param {Box} box @returns {Point[]} */
function corners({ x, y, width, height }) {
  return [
    { x, y },
    { x: x + width, y },
    { x: x + width, y: y + height },
    { x, y: y + height },
  ];
}

/** @param {Point[]} points sensor px @param {Viewport} viewport */
function path(points, viewport) {
  const places = points.map((point) => viewport.toCss(point));
  return `M${places.map(({ x, y }) => `${x.toFixed(2)} ${y.toFixed(2)}`).join("L")}Z`;
}

/**
 * Draw the zones as SVG: shaded where one eye or none reaches, clear where both do.
 * @param {ReachDocument} reach
 * @param {(points: Point[]) => string} path of a closed outline
 * @param {Point[]} picture its corners
 */
function zones(reach, path, picture) {
  const left = path(/** @type {Corners} */ (reach.left_px).map(([x, y]) => ({ x, y })));
  const right = path(/** @type {Corners} */ (reach.right_px).map(([x, y]) => ({ x, y })));
  const whole = path(picture);
  const outside = (/** @type {string} */ id, /** @type {string} */ inner) =>
    svg`<clipPath id=${id}><path d="${whole} ${inner}" clip-rule="evenodd"></path></clipPath>`;
  return [
    outside("reach-not-left", left),
    outside("reach-not-right", right),
    svg`<path class="beyond" d="${whole} ${right}" fill-rule="evenodd" clip-path="url(#reach-not-left)"></path>`,
    svg`<path class="one-eye left" d=${left} clip-path="url(#reach-not-right)"></path>`,
    svg`<path class="one-eye right" d=${right} clip-path="url(#reach-not-left)"></path>`,
    svg`<path class="edge left" d=${left}></path>`,
    svg`<path class="edge right" d=${right}></path>`,
  ];
}

/** The legend of the shades, in the picture's corner. */
export class ReachLegend {
  #where = h("span", { class: "where" });

  constructor() {
    const key = (/** @type {string} */ kind, /** @type {string} */ text) =>
      html`<span class="key ${kind}">${text}</span>`;
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
      setText(
        this.#where,
        reach.distance_m === null ? "far away" : `at ${number(reach.distance_m, reach.distance_m < 10 ? 1 : 0)} m`,
      );
  }
}
