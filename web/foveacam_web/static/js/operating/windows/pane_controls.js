// The controls of a pane of a board: its mark, which is dragged onto another pane, the choice of its source, and the
// buttons that split and close it.

import { h, html } from "../../elements/dom.js";
import { icon } from "../../elements/icons.js";

/**
 * @import { Axis, Source } from "#page"
 * @typedef {{
 *   split: (source: Source, axis: Axis) => void, close: (source: Source) => void,
 *   exchange: (source: Source, other: Source) => void
 * }} Acts what the controls do
 */

// of a pane, CSS px: its controls stay in reach
const LEAST_WIDTH = 150;
const LEAST_HEIGHT = 90;

/** The controls of the pane of one source. */
export class PaneControls {
  #source;
  #sources;
  #acts;

  /**
   * @param {Source} source
   * @param {{acts: Acts, titleOf: (source: Source) => string, sources: readonly Source[]}} context `sources`: that it can show
   */
  constructor(source, { acts, titleOf, sources }) {
    this.#source = source;
    this.#sources = sources;
    this.#acts = acts;
    this.select = this.#makeSelect(titleOf);
    this.grip = h("span", { class: "grip", title: "Drag onto another pane to change places" }, icon("raster"));
    this.element = h("span", { class: "controls" }, this.#buttons(titleOf(source)));
  }

  /**
   * Enable what layout and room allow.
   * @param {HTMLElement} slot
   * @param {{several: boolean, full: boolean}} now `full`: every source is shown
   */
  allow({ clientWidth, clientHeight }, { several, full }) {
    const refused = {
      row: full || clientWidth < 2 * LEAST_WIDTH,
      column: full || clientHeight < 2 * LEAST_HEIGHT,
      close: !several,
    };
    for (const button of this.element.querySelectorAll("button"))
      button.disabled = refused[/** @type {keyof typeof refused} */ (button.dataset["act"])];
    this.select.value = this.#source;
  }

  /** Exchange this pane with the one on which its grip is dropped. @param {HTMLElement} slot */
  listenToGrip(slot) {
    const under = (/** @type {PointerEvent} */ { clientX, clientY }) => {
      const found = document.elementFromPoint(clientX, clientY)?.closest(".slot");
      return found instanceof HTMLElement && found !== slot ? found : null;
    };
    const mark = (/** @type {HTMLElement | null} */ target) => {
      for (const marked of document.querySelectorAll(".slot.target"))
        marked.classList.toggle("target", marked === target);
      target?.classList.add("target");
    };
    this.grip.addEventListener("pointerdown", (event) => {
      event.preventDefault();
      this.grip.setPointerCapture(event.pointerId);
    });
    this.grip.addEventListener("pointermove", (event) => {
      if (this.grip.hasPointerCapture(event.pointerId)) mark(under(event));
    });
    this.grip.addEventListener("pointerup", (event) => {
      const other = under(event)?.dataset["source"] ?? "";
      mark(null);
      this.#exchange(other);
    });
    this.grip.addEventListener("pointercancel", () => mark(null));
  }

  /** @param {string} other */
  #exchange(other) {
    const known = this.#sources.find((source) => source === other);
    if (known) this.#acts.exchange(this.#source, known);
  }

  /** @param {(source: Source) => string} titleOf */
  #makeSelect(titleOf) {
    const select = h(
      "select",
      { "aria-label": "Source of this pane", on: { change: () => this.#exchange(select.value) } },
      this.#sources.map(
        (source) => html`<option value=${source} ?selected=${source === this.#source}>${titleOf(source)}</option>`,
      ),
    );
    return select;
  }

  /** @param {string} title */
  #buttons(title) {
    const button = (
      /** @type {string} */ label,
      /** @type {import("../../elements/icons.js").IconName} */ picture,
      /** @type {string} */ act,
      /** @type {() => void} */ click,
    ) =>
      h(
        "button",
        { type: "button", class: "tool", "aria-label": label, title: label, data: { act }, on: { click } },
        icon(picture),
      );
    const [source, acts] = [this.#source, this.#acts];
    return [
      button(`Split ${title}: new pane to the right`, "columns", "row", () => acts.split(source, "row")),
      button(`Split ${title}: new pane below`, "rows", "column", () => acts.split(source, "column")),
      button(`Close ${title}`, "close", "close", () => acts.close(source)),
    ];
  }
}

/** Place a pane by its box. @param {HTMLElement} slot @param {import("#page").Box} box */
export function placeSlot(slot, { left, top, width, height }) {
  const share = (/** @type {number} */ part) => `${100 * part}%`;
  Object.assign(slot.style, { left: share(left), top: share(top), width: share(width), height: share(height) });
}
