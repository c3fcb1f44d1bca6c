// The panes of a board and their dividers: places them as the layout says. `keep` says where the layout is kept: in the
// address of a window of views, or beside a recording.

import { h } from "../../elements/dom.js";
import {
  SOURCES,
  USUAL_LAYOUT,
  closePane,
  exchangePane,
  moveDivider,
  nextSource,
  placesOf,
  sourcesOf,
  splitPane,
} from "./layout.js";

/**
 * @import { Box, Divider, Layout, Source } from "#page"
 * @import { Acts } from "./pane_controls.js"
 * @typedef {{
 *   element: HTMLElement, select: HTMLSelectElement, place: (box: Box) => void,
 *   allow: (now: {several: boolean, full: boolean}) => void
 * }} BoardSlot the pane of one source
 * @typedef {{read: () => Layout | null, write: (layout: Layout) => void, shown?: (sources: Source[]) => void}} LayoutKeeper
 */

const STEP = 0.02;

/** The window's panes. */
export class Board {
  #place;
  #make;
  #keep;
  #sources;
  #usual;
  /** @type {Layout} */
  #layout;
  /** @type {Map<Source, BoardSlot>} */
  #slots = new Map();
  /** By path and axis. @type {Map<string, HTMLElement>} */
  #dividers = new Map();

  /**
   * @param {HTMLElement} place
   * @param {{
   *   make: (source: Source, acts: Acts) => BoardSlot, keep: LayoutKeeper, sources?: readonly Source[], usual?: Layout,
   *   signal?: AbortSignal
   * }} options `usual`: the layout where none is kept
   */
  constructor(place, { make, keep, sources = SOURCES, usual = USUAL_LAYOUT, signal }) {
    this.#place = place;
    this.#make = make;
    this.#keep = keep;
    this.#sources = sources;
    this.#usual = usual;
    this.#layout = usual;
    addEventListener("resize", () => this.#allow(), signal ? { signal } : {});
    this.read();
  }

  get layout() {
    return this.#layout;
  }

  /** Show the layout that is kept. */
  read() {
    this.#layout = this.#keep.read() ?? this.#usual;
    this.#show();
  }

  /** Show another layout, and keep it. @param {Layout} layout */
  change(layout) {
    this.#change(layout);
  }

  /** @param {Layout} layout @param {Source} [focus] whose select gets the keyboard */
  #change(layout, focus) {
    this.#layout = layout;
    this.#show();
    this.#keep.write(layout);
    if (focus) this.#slot(focus).select.focus();
  }

  /** Place everything; an element that stays is not moved in the document, so that the 3D view is not loaded again. */
  #show() {
    const { panes, dividers } = placesOf(this.#layout);
    const shown = sourcesOf(this.#layout);
    this.#keep.shown?.(shown);
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
    const now = { several: shown.length > 1, full: nextSource(this.#layout, this.#sources) === null };
    for (const source of shown) this.#slot(source).allow(now);
  }

  /** @param {Source} source @returns {BoardSlot} */
  #slot(source) {
    const known = this.#slots.get(source);
    if (known) return known;
    const made = this.#make(source, this.#acts());
    this.#slots.set(source, made);
    return made;
  }

  /** @returns {Acts} */
  #acts() {
    return {
      split: (source, axis) => {
        const added = nextSource(this.#layout, this.#sources);
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
