// Shows the pattern of the server in the middle of the page, at its true size.

import { RequestError, file } from "../../transport/api.js";
import { ASSUMED_PX_PER_MM, isTooLarge, placeOf } from "./scale.js";

/** @import { PatternDocument } from "#api" */

/** The pattern on the page; it stays when the server goes. */
export class Sheet {
  #place;
  /** @type {PatternDocument | null} */
  #shown = null;
  #wanted = "";

  /** @param {HTMLElement} place */
  constructor(place) {
    this.#place = place;
  }

  /** Load the drawing of a pattern, unless it is shown already. @param {PatternDocument} shown */
  async load(shown) {
    const wanted = JSON.stringify(shown);
    if (wanted === this.#wanted) return;
    this.#wanted = wanted;
    if (shown.pattern.kind === "blank") {
      this.#put(shown, null);
      return;
    }
    try {
      const { content } = await file("/displays/pattern.svg");
      const drawing = new DOMParser().parseFromString(await content.text(), "image/svg+xml").documentElement;
      if (this.#wanted === wanted) this.#put(shown, document.importNode(drawing, true));
    } catch (error) {
      if (!(error instanceof RequestError)) throw error;
      this.#wanted = ""; // the next report of the server asks for it again
    }
  }

  /** @param {PatternDocument} shown @param {Element | null} drawing */
  #put(shown, drawing) {
    this.#shown = shown;
    this.#place.replaceChildren(...(drawing ? [drawing] : []));
  }

  /**
   * Place the drawing; one that does not fit is not shown. `ratio`: device pixels a CSS pixel.
   * @param {{width_px: number, height_px: number, px_per_mm: number | null, ratio: number}} screen
   */
  place({ width_px, height_px, px_per_mm, ratio }) {
    const drawing = this.#place.firstElementChild;
    const { width_mm = null, height_mm = null } = this.#shown ?? {};
    if (!(drawing instanceof SVGElement) || width_mm === null || height_mm === null) return;
    const scale = px_per_mm ?? ASSUMED_PX_PER_MM * ratio;
    const of = { width_mm, height_mm, width_px, height_px, px_per_mm: scale };
    const { width, height, left, top } = placeOf(of);
    drawing.style.display = px_per_mm !== null && isTooLarge(of) ? "none" : "";
    drawing.style.left = `${left / ratio}px`;
    drawing.style.top = `${top / ratio}px`;
    drawing.style.width = `${width / ratio}px`;
    drawing.style.height = `${height / ratio}px`;
  }
}
