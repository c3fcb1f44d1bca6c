// The dialog in which a person sets the scale of the screen: an outline is dragged or stepped to the size of what lies on it.

import { fill, h, html, setText } from "../../elements/dom.js";
import { number } from "../../elements/format.js";
import { icon } from "../../elements/icons.js";
import { ASSUMED_PX_PER_MM, REFERENCES } from "./scale.js";

const LEAST_PX = 40;

/** The dialog; `saved` gets the device pixels a millimetre. */
export class ScaleDialog {
  #saved;
  /** @type {keyof typeof REFERENCES} */
  #kind = "card";
  /** Device pixels a millimetre, while the outline is being fitted. */
  #px_per_mm = ASSUMED_PX_PER_MM;

  /** @param {(px_per_mm: number) => void} saved */
  constructor(saved) {
    this.#saved = saved;
    this.handle = h("button", {
      type: "button",
      class: "handle",
      role: "slider",
      "aria-label": "Length of the outline in pixels of the screen",
      "aria-valuemin": LEAST_PX,
    });
    this.outline = h("div", { class: "outline" }, this.handle);
    this.readout = h("output", { class: "number" });
    this.element = h("dialog", { class: "scale-dialog", "aria-labelledby": "scale-title" }, this.#content());
    this.#listen();
    addEventListener("resize", () => this.element.open && this.#show());
  }

  /** @param {number | null} px_per_mm the scale so far */
  open(px_per_mm) {
    this.#px_per_mm = px_per_mm ?? ASSUMED_PX_PER_MM * devicePixelRatio;
    this.element.showModal();
    this.#show();
    this.handle.focus();
  }

  #content() {
    const kinds = Object.entries(REFERENCES).map(
      ([kind, { name }]) =>
        html`<label>
          <input
            type="radio" name="reference" value=${kind} .checked=${kind === this.#kind}
            @change=${() => this.#choose(/** @type {keyof typeof REFERENCES} */ (kind))}
          />
          ${name}
        </label>`,
    );
    const step = (/** @type {number} */ pixels, /** @type {"plus" | "minus"} */ picture, /** @type {string} */ label) =>
      h(
        "button",
        { type: "button", class: "plain", "aria-label": label, on: { click: () => this.#step(pixels) } },
        icon(picture),
        Math.abs(pixels) > 1 && html`<span>${Math.abs(pixels)}</span>`,
      );
    return html`<h1 id="scale-title">Set the size</h1>
      <p class="lead">
        Lay it on the screen, one corner on the dot, and drag the handle, or use the buttons or arrow keys, until the
        outline fits.
      </p>
      <p class="kinds">${kinds}</p>
      <p class="buttons">
        ${step(-10, "minus", "Ten pixels shorter")} ${step(-1, "minus", "One pixel shorter")}
        ${step(1, "plus", "One pixel longer")} ${step(10, "plus", "Ten pixels longer")} ${this.readout}
        <button type="button" class="plain primary" @click=${() => this.#save()}>Save</button>
        <button type="button" class="plain" @click=${() => this.element.close()}>Cancel</button>
      </p>
      <div class="field-of-outline">${this.outline}</div>`;
  }

  #listen() {
    this.handle.addEventListener("pointerdown", (event) => {
      this.handle.setPointerCapture(event.pointerId);
      event.preventDefault();
      this.handle.focus();
    });
    this.handle.addEventListener("pointermove", (event) => {
      if (!this.handle.hasPointerCapture(event.pointerId)) return;
      const box = this.outline.getBoundingClientRect();
      const length = this.#upright ? event.clientY - box.top : event.clientX - box.left;
      this.#put(Math.round(length * devicePixelRatio));
    });
    this.handle.addEventListener("keydown", (event) => {
      const sign = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1 }[event.key];
      if (sign === undefined) return;
      event.preventDefault();
      this.#step(sign * (event.shiftKey ? 10 : 1));
    });
  }

  get #reference() {
    return REFERENCES[this.#kind];
  }

  /** Whether the outline stands upright, as on a telephone, which is narrower than a card is long. */
  get #upright() {
    return innerHeight > innerWidth;
  }

  get #length_px() {
    return Math.round(this.#px_per_mm * this.#reference.long_mm);
  }

  /** @param {keyof typeof REFERENCES} kind */
  #choose(kind) {
    this.#kind = kind;
    this.#show();
  }

  /** @param {number} pixels */
  #step(pixels) {
    this.#put(this.#length_px + pixels);
  }

  /** @param {number} length_px of the outline, device pixels */
  #put(length_px) {
    this.#px_per_mm = Math.max(LEAST_PX, length_px) / this.#reference.long_mm;
    this.#show();
  }

  #show() {
    const { long_mm, across_mm } = this.#reference;
    const along = (long_mm * this.#px_per_mm) / devicePixelRatio;
    const across = (across_mm * this.#px_per_mm) / devicePixelRatio;
    const [width, height] = this.#upright ? [across, along] : [along, across];
    this.outline.style.width = `${width}px`;
    this.outline.style.height = `${height}px`;
    this.outline.classList.toggle("line", across_mm === 0);
    this.outline.classList.toggle("upright", this.#upright);
    this.handle.setAttribute("aria-valuenow", String(this.#length_px));
    fill(this.handle, icon(this.#upright ? "low" : "on"));
    setText(this.readout, `${number(this.#px_per_mm, 3)} px/mm`);
  }

  #save() {
    this.element.close();
    this.#saved(this.#px_per_mm);
  }
}
