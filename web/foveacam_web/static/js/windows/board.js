// The panes of a window and their dividers: places them as the layout says, and keeps the layout in the address.

import { decoded } from "../addresses.js";
import { h } from "../dom.js";
import {
  USUAL_LAYOUT,
  closePane,
  exchangePane,
  layoutOf,
  layoutText,
  moveDivider,
  nextSource,
  placesOf,
  sourcesOf,
  splitPane,
} from "./layout.js";
import { keepLayout } from "./last_layout.js";
import { Slot, titleOf } from "./slot.js";

/**
 * @import { Divider, Layout, Source } from "#page"
 * @typedef {Omit<ConstructorParameters<typeof Slot>[1], "acts">} SlotContext
 */

const STEP = 0.02;

/** The window's panes. */
export class Board {
  #place;
  #context;
  /** @type {Layout} */
  #layout = USUAL_LAYOUT;
  /** @type {Map<Source, Slot>} */
  #slots = new Map();
  /** By path and axis. @type {Map<string, HTMLElement>} */
  #dividers = new Map();

  /** @param {HTMLElement} place @param {SlotContext} context */
  constructor(place, context) {
    this.#place = place;
    this.#context = context;
    addEventListener("hashchange", () => this.#read());
    addEventListener("resize", () => this.#allow());
    this.#read();
  }

  #read() {
    this.#layout = layoutOf(decoded(location.hash.slice(1)) ?? "") ?? USUAL_LAYOUT;
    this.#show();
  }

  /** @param {Layout} layout @param {Source} [focus] whose select gets the keyboard */
  #change(layout, focus) {
    this.#layout = layout;
    keepLayout(layout);
    history.replaceState(null, "", `#${layoutText(layout)}`);
    this.#show();
    if (focus) this.#slot(focus).select.focus();
  }

  /** Place everything; an element that stays is not moved in the document, so that the 3D view is not loaded again. */
  #show() {
    const { panes, dividers } = placesOf(this.#layout);
    const shown = sourcesOf(this.#layout);
    document.title = `${shown.map(titleOf).join(", ")}: FoveaCam Duo`;
    for (const [source, { element }] of this.#slots) if (!shown.includes(source)) element.remove();
    for (const { source, box } of panes) {
      const slot = this.#slot(source);
      slot.place(box);
      if (!slot.element.isConnected) this.#place.append(slot.element);
    }
    this.#allow();
    for (const [key, element] of this.#dividers) {
      if (dividers.some(({ path, axis }) => `${path}:${axis}` === key)) continue;
      element.remove();
      this.#dividers.delete(key);
    }
    for (const divider of dividers) this.#placeDivider(divider);
  }

  #allow() {
    const shown = sourcesOf(this.#layout);
    const now = { several: shown.length > 1, full: nextSource(this.#layout) === null };
    for (const source of shown) this.#slot(source).allow(now);
  }

  /** @param {Source} source @returns {Slot} */
  #slot(source) {
    const known = this.#slots.get(source);
    if (known) return known;
    const made = new Slot(source, { ...this.#context, acts: this.#acts() });
    this.#slots.set(source, made);
    return made;
  }

  /** @returns {import("./slot.js").Acts} */
  #acts() {
    return {
      split: (source, axis) => {
        const added = nextSource(this.#layout);
        if (added) this.#change(splitPane(this.#layout, source, axis, added), added);
      },
      close: (source) => {
        const layout = closePane(this.#layout, source);
        this.#change(layout, sourcesOf(layout)[0]);
      },
      exchange: (source, other) => this.#change(exchangePane(this.#layout, source, other), other),
    };
  }

  /** @param {Divider} divider */
  #placeDivider({ path, axis, share, box }) {
    const key = `${path}:${axis}`;
    const element = this.#dividers.get(key) ?? this.#makeDivider(key, path);
    element.className = `divider ${axis}`;
    element.setAttribute("aria-orientation", axis === "row" ? "vertical" : "horizontal");
    element.setAttribute("aria-valuenow", String(Math.round(share * 100)));
    const percent = (/** @type {number} */ part) => `${100 * part}%`;
    Object.assign(
      element.style,
      axis === "row"
        ? {
            left: percent(box.left + share * box.width),
            top: percent(box.top),
            bottom: percent(1 - box.top - box.height),
          }
        : {
            top: percent(box.top + share * box.height),
            left: percent(box.left),
            right: percent(1 - box.left - box.width),
          },
    );
  }

  /** @param {string} key @param {string} path */
  #makeDivider(key, path) {
    const element = h("div", {
      role: "separator",
      tabindex: 0,
      "aria-label": "Divider of two panes",
      "aria-valuemin": 10,
      "aria-valuemax": 90,
    });
    const here = () => placesOf(this.#layout).dividers.find((divider) => divider.path === path);
    const move = (/** @type {number} */ share) => this.#change(moveDivider(this.#layout, path, share));
    element.addEventListener("pointerdown", (event) => {
      event.preventDefault();
      element.setPointerCapture(event.pointerId);
      element.focus();
    });
    element.addEventListener("pointermove", (event) => {
      const divider = here();
      if (!divider || !element.hasPointerCapture(event.pointerId)) return;
      const whole = this.#place.getBoundingClientRect();
      const { axis, box } = divider;
      move(
        axis === "row"
          ? ((event.clientX - whole.left) / whole.width - box.left) / box.width
          : ((event.clientY - whole.top) / whole.height - box.top) / box.height,
      );
    });
    element.addEventListener("dblclick", () => move(0.5));
    element.addEventListener("keydown", (event) => {
      const sign = { ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 }[event.key];
      const divider = here();
      if (sign === undefined || !divider) return;
      event.preventDefault();
      move(divider.share + sign * STEP);
    });
    this.#dividers.set(key, element);
    this.#place.append(element);
    return element;
  }
}
