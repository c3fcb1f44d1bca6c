// The interactive drawing of the plan: a click places a target, a drag moves one, pointer or arrow keys show how many
// targets are in sight. Changes are reported to the plan's owner, which calls `show` again.

import { fill, h, s, setText } from "../../elements/dom.js";
import { drawScene, layOut, sightLines } from "./drawing.js";
import { featuresOf, holds, outlinesOf } from "./geometry.js";
import { sightWords } from "./words.js";

/**
 * @import { MapPoint } from "#page"
 * @import { Layout, Scene } from "./drawing.js"
 * @typedef {{add: (place: MapPoint) => void, move: (index: number, place: MapPoint) => void, remove: (index: number) => void}} Hands
 */

const GRIP_PX = 16;
const CLICK_PX = 5;
const KEY_PX = 8;
const LEAST_PX = 320; // least height of the plan
const AROUND_PX = 300; // height of what is above and below it in the window
const STEPS = Object.freeze(
  /** @type {Record<string, [number, number]>} */ ({
    ArrowLeft: [-1, 0],
    ArrowRight: [1, 0],
    ArrowUp: [0, -1],
    ArrowDown: [0, 1],
  }),
);

/** The drawing and its pointer and key handlers. */
export class PlanView {
  #hands;
  #svg = s("svg", { class: "plan-drawing", "aria-hidden": "true" });
  #readout = h("p", { class: "plan-readout", role: "status" });
  #surface = h("div", { class: "plan-surface", tabindex: 0, role: "application" }, this.#svg);
  /** @type {Scene | null} */
  #scene = null;
  /** @type {Layout | null} */
  #layout = null;
  #outlines = /** @type {import("#page").Outlines[]} */ ([]);
  /** The point whose targets in sight are shown, in the drawing. @type {{x: number, y: number} | null} */
  #probe = null;
  /** @type {{index: number | null, from: {x: number, y: number}, moved: boolean} | null} */
  #held = null;
  #width = 0;

  /** @param {Hands} hands */
  constructor(hands) {
    this.#hands = hands;
    this.element = h("div", { class: "plan-view" }, this.#surface, this.#readout);
    new ResizeObserver(() => this.#fit()).observe(this.#surface);
    this.#surface.addEventListener("pointerdown", (event) => this.#down(event));
    this.#surface.addEventListener("pointermove", (event) => this.#move(event));
    this.#surface.addEventListener("pointerup", (event) => this.#up(event));
    this.#surface.addEventListener("pointercancel", () => (this.#held = null));
    this.#surface.addEventListener("pointerleave", () => this.#held === null && this.#ask(null));
    this.#surface.addEventListener("keydown", (event) => this.#key(event));
    this.#surface.addEventListener("blur", () => this.#ask(null));
  }

  get drawing() {
    return this.#svg;
  }

  /** @param {Scene} scene */
  show(scene) {
    this.#scene = scene;
    this.#outlines = featuresOf(scene.regions?.geojson, "region").map(({ geometry }) => outlinesOf(geometry));
    this.#draw();
  }

  #fit() {
    const width = Math.round(this.#surface.clientWidth);
    if (width === this.#width || width === 0) return;
    this.#width = width;
    this.#draw();
  }

  #draw() {
    if (!this.#scene || this.#width === 0) return;
    const layout = layOut(this.#scene, { width: this.#width, tallest: Math.max(LEAST_PX, innerHeight - AROUND_PX) });
    this.#layout = layout;
    for (const [name, value] of Object.entries({
      viewBox: `0 0 ${layout.width} ${layout.height}`,
      width: layout.width,
      height: layout.height,
    })) {
      this.#svg.setAttribute(name, String(value));
    }
    fill(this.#svg, ...drawScene(this.#scene, layout));
    const { targets_m, map, stale } = this.#scene;
    this.#surface.setAttribute(
      "aria-label",
      `Plan with ${targets_m.length} targets and ${map.obstacles} obstacles. Arrow keys look around, Enter places a target, Delete removes the one that is near.`,
    );
    this.#surface.setAttribute("aria-busy", String(stale));
    this.#ask(this.#probe);
  }

  /** @param {MouseEvent} event */
  #at(event) {
    const box = this.#svg.getBoundingClientRect();
    return { x: event.clientX - box.left, y: event.clientY - box.top };
  }

  /** Return the index of the target near a point, or null. @param {{x: number, y: number}} at */
  #gripped(at) {
    const [scene, layout] = [this.#scene, this.#layout];
    if (!scene || !layout) return null;
    const far = scene.targets_m.map((place) => {
      const { x, y } = layout.sheet.toDrawing(place);
      return Math.hypot(x - at.x, y - at.y);
    });
    const nearest = far.indexOf(Math.min(...far));
    return nearest >= 0 && (far[nearest] ?? Infinity) <= GRIP_PX ? nearest : null;
  }

  /** @param {PointerEvent} event */
  #down(event) {
    if (event.button !== 0 || !event.isPrimary) return;
    const from = this.#at(event);
    const index = this.#gripped(from);
    this.#held = { index, from, moved: false };
    if (index === null) return;
    this.#surface.setPointerCapture(event.pointerId);
    event.preventDefault(); // prevents selecting text and scrolling
    this.#surface.focus({ preventScroll: true });
  }

  /** @param {PointerEvent} event */
  #move(event) {
    const at = this.#at(event);
    const held = this.#held;
    if (held && Math.hypot(at.x - held.from.x, at.y - held.from.y) > CLICK_PX) held.moved = true;
    if (held?.moved && held.index !== null) {
      const place = this.#ground(at);
      if (place) this.#hands.move(held.index, place);
    }
    this.#surface.classList.toggle("grips", this.#gripped(at) !== null);
    this.#ask(at);
  }

  /** @param {PointerEvent} event */
  #up(event) {
    const held = this.#held;
    this.#held = null;
    const at = this.#at(event);
    if (held && !held.moved && held.index === null) this.#add(at);
  }

  /** @param {{x: number, y: number}} at */
  #add(at) {
    const place = this.#ground(at);
    if (place && this.#layout && at.y <= this.#layout.plan) this.#hands.add(place);
  }

  /**
   * Return the map point, limited to the map; null where the drawing shows no ground.
   * @param {{x: number, y: number}} at
   * @returns {MapPoint | null}
   */
  #ground(at) {
    if (!this.#scene || !this.#layout) return null;
    const [x0 = 0, y0 = 0, x1 = 0, y1 = 0] = this.#scene.map.bounds_m;
    const [x, y] = this.#layout.sheet.toGround(at);
    const slack = 4 / this.#layout.sheet.scale;
    if (this.#held === null && (x < x0 - slack || x > x1 + slack || y < y0 - slack || y > y1 + slack)) return null;
    const rounded = (/** @type {number} */ value, /** @type {number} */ low, /** @type {number} */ high) =>
      Math.min(high, Math.max(low, Number(value.toFixed(2))));
    return [rounded(x, x0, x1), rounded(y, y0, y1)];
  }

  /** @param {KeyboardEvent} event */
  #key(event) {
    const layout = this.#layout;
    if (!layout || event.ctrlKey || event.metaKey || event.altKey) return;
    const step = STEPS[event.key];
    const probe = this.#probe ?? { x: layout.width / 2, y: layout.plan / 2 };
    const gripped = this.#gripped(probe);
    if (step) {
      const far = event.shiftKey ? 5 * KEY_PX : KEY_PX;
      this.#ask({
        x: Math.min(layout.width, Math.max(0, probe.x + far * step[0])),
        y: Math.min(layout.plan, Math.max(0, probe.y + far * step[1])),
      });
    } else if (event.key === "Enter") this.#add(probe);
    else if ((event.key === "Delete" || event.key === "Backspace") && gripped !== null) this.#hands.remove(gripped);
    else return;
    event.preventDefault();
    event.stopPropagation(); // the console uses some of these keys otherwise
  }

  /** Show which targets are in sight from a point. @param {{x: number, y: number} | null} at */
  #ask(at) {
    this.#probe = at;
    const group = this.#svg.querySelector(".sights");
    const [scene, layout] = [this.#scene, this.#layout];
    if (!group || !scene || !layout) return;
    const place = at && at.y <= layout.plan ? this.#ground(at) : null;
    if (!place) {
      fill(group);
      return setText(
        this.#readout,
        scene.targets_m.length > 0
          ? "Point at the plan to see how many targets are in sight from there."
          : "Click on the plan to place a target.",
      );
    }
    const seen = this.#outlines.flatMap((outlines, target) => {
      const to = scene.targets_m[target];
      return to && holds(outlines, place) ? [{ place: to, target }] : [];
    });
    fill(group, ...sightLines(layout.sheet, place, seen));
    setText(
      this.#readout,
      sightWords(
        place,
        seen.map(({ target }) => target),
        scene.targets_m.length,
      ),
    );
  }
}
