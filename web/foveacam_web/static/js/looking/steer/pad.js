// A square pad for two values: shows the present value and the target, and steers by dragging, keys or numbers.

import { h, s } from "../../elements/dom.js";
import { number } from "../../elements/format.js";
import { clamp, steppedBy, valueOnPad } from "./words.js";

/**
 * @import { Point } from "#page"
 * @typedef {{
 *   name: string, unit: string, kind: string, step: number, fine: number, decimals: number,
 *   steer: (to: Point) => void, release: () => void, go: (to: Point) => void
 * }} PadOptions `step`, `fine`: of the arrow keys; `steer`: called at every move while it is held
 */

const SLACK_PX = 3; // a press that moves less is a click, which steers nothing
const HALF = 100;
const REPORT_MS = 700; // by then the server has reported a target

/** A pad and its two numbers. */
export class SteerPad {
  #options;
  #most = 1;
  /** Where the next step of a key begins. @type {Point} */
  #base = { x: 0, y: 0 };
  #base_since_ms = -REPORT_MS;
  /** Where it was steered to last, while it is held. @type {Point | null} */
  #aim = null;
  /** @type {Point | null} */
  #pressed = null;
  #surface;
  #dot = s("circle", { class: "now", r: 5, cx: 0, cy: 0 });
  #ring = s("g", { class: "aim" }, s("circle", { r: 9 }), s("path", { d: "M-14 0H-5M5 0H14M0 -14V-5M0 5V14" }));
  #entries;

  /** @param {PadOptions} options */
  constructor(options) {
    this.#options = options;
    const { name, unit, kind } = options;
    this.#surface = h("div", {
      class: "steer-surface",
      tabindex: 0,
      role: "application",
      "aria-label": `${name}: drag, or arrow keys, with Shift finely; Home or a double click: rest`,
      title: "Drag to steer; arrow keys, with Shift finely; double click: rest",
      on: {
        pointerdown: (/** @type {PointerEvent} */ event) => this.#down(event),
        pointermove: (/** @type {PointerEvent} */ event) => this.#move(event),
        pointerup: () => this.#up(),
        pointercancel: () => this.#up(),
        dblclick: () => options.go({ x: 0, y: 0 }),
        keydown: (/** @type {KeyboardEvent} */ event) => this.#key(event),
        keyup: (/** @type {KeyboardEvent} */ event) => event.key.startsWith("Arrow") && this.#letGo(),
        blur: () => this.#letGo(),
      },
    });
    this.#surface.append(this.#drawing());
    this.#entries = /** @type {const} */ (["x", "y"]).map((axis) => this.#entry(axis));
    this.element = h(
      "div",
      { class: `steer-pad ${kind}`, role: "group", "aria-label": name },
      h("h4", { text: name }),
      this.#surface,
      h(
        "div",
        { class: "steer-numbers" },
        this.#entries.map((entry) =>
          h(
            "label",
            { class: "entry" },
            entry.dataset["axis"] ?? "",
            " ",
            entry,
            h("span", { class: "unit", text: unit }),
          ),
        ),
      ),
    );
  }

  /**
   * @param {{most: number, now: Point | null, target: Point | null, open: boolean}} state `open`: whether it steers
   */
  show({ most, now, target, open }) {
    this.#most = most;
    this.#surface.classList.toggle("shut", !open);
    for (const entry of this.#entries) {
      entry.disabled = !open;
      entry.min = String(-most);
      entry.max = String(most);
    }
    this.#dot.toggleAttribute("hidden", !now);
    if (performance.now() - this.#base_since_ms > REPORT_MS) this.#base = target ?? now ?? this.#base;
    const aim = this.#aim ?? target;
    this.#ring.toggleAttribute("hidden", !aim);
    if (now) this.#place(this.#dot, now);
    if (aim) this.#place(this.#ring, aim);
    const shown = aim ?? now;
    for (const entry of this.#entries) {
      if (entry === document.activeElement) continue;
      const value = shown?.[/** @type {"x" | "y"} */ (entry.dataset["axis"])];
      entry.value = value === undefined ? "" : value.toFixed(this.#options.decimals);
    }
    this.#surface.dataset["now"] = now ? `${number(now.x, 1)} ${number(now.y, 1)}` : "";
  }

  #drawing() {
    const lines = [-0.5, 0, 0.5].flatMap((share) => {
      const at = share * HALF;
      const kind = share === 0 ? "axis" : "grid";
      return [
        s("line", { class: kind, x1: -HALF, x2: HALF, y1: at, y2: at }),
        s("line", { class: kind, y1: -HALF, y2: HALF, x1: at, x2: at }),
      ];
    });
    const view_box = `${-HALF} ${-HALF} ${2 * HALF} ${2 * HALF}`;
    return s("svg", { viewBox: view_box, "aria-hidden": "true" }, lines, this.#ring, this.#dot);
  }

  /** @param {"x" | "y"} axis */
  #entry(axis) {
    const entry = h("input", {
      type: "number",
      step: "any",
      inputmode: "decimal",
      data: { axis },
      "aria-label": `${this.#options.name}, ${axis}`,
      on: { change: () => this.#typed(axis, entry) },
    });
    return entry;
  }

  /** @param {Element} mark @param {Point} value */
  #place(mark, { x, y }) {
    const at = (/** @type {number} */ value) => ((clamp(value, this.#most) / this.#most) * HALF).toFixed(2);
    mark.setAttribute("transform", `translate(${at(x)} ${at(y)})`);
  }

  get #shut() {
    return this.#surface.classList.contains("shut");
  }

  /** @param {PointerEvent} event */
  #down(event) {
    if (event.button !== 0 || this.#shut) return;
    this.#surface.setPointerCapture(event.pointerId);
    this.#pressed = { x: event.clientX, y: event.clientY };
  }

  /** @param {PointerEvent} event */
  #move(event) {
    if (!this.#pressed) return;
    const moved = Math.hypot(event.clientX - this.#pressed.x, event.clientY - this.#pressed.y);
    if (!this.#aim && moved < SLACK_PX) return;
    const box = this.#surface.getBoundingClientRect();
    this.#steer(valueOnPad({ x: event.clientX - box.left, y: event.clientY - box.top }, box.width, this.#most));
  }

  #up() {
    this.#pressed = null;
    this.#letGo();
  }

  /** @param {KeyboardEvent} event */
  #key(event) {
    if (this.#shut || event.ctrlKey || event.metaKey || event.altKey) return;
    const { step, fine, go } = this.#options;
    const pad = { step: event.shiftKey ? fine : step, most: this.#most };
    const to = steppedBy(this.#base, event.key, pad);
    if (to) this.#steer(to);
    else if (event.key === "Home") go({ x: 0, y: 0 });
    else return;
    event.preventDefault();
  }

  /** @param {Point} to */
  #steer(to) {
    this.#aim = this.#base = to;
    this.#base_since_ms = performance.now();
    this.#place(this.#ring, to);
    this.#options.steer(to);
  }

  #letGo() {
    if (!this.#aim) return;
    this.#aim = null;
    this.#options.release();
  }

  /** @param {"x" | "y"} axis @param {HTMLInputElement} entry */
  #typed(axis, entry) {
    const value = entry.valueAsNumber;
    if (Number.isFinite(value)) this.#options.go({ ...this.#base, [axis]: value });
  }
}
