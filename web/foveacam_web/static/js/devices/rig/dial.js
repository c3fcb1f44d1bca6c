// A numeric setting: field and slider. Sends a value and shows the one that was taken.

import { fill, h, html, setText } from "../../elements/dom.js";
import { sentence } from "../../elements/format.js";
import { decades, plainly, shareOf, snapped, spanText, valueAt, WAY } from "./scale.js";
import { textButton } from "../../elements/parts.js";

/**
 * @import { SpanDocument } from "#api"
 * @typedef {{taken: number | null, refusal: string | null}} Outcome
 * @typedef {{
 *   name: string, unit: string, of: string, kind?: import("./scale.js").ScaleKind, presets?: number[], note?: string,
 *   title?: string, whole?: boolean, beside?: HTMLElement, below?: HTMLElement, ask: (value: number) => Promise<Outcome>
 * }} Options `of`: whose setting it is, for screen readers; `note`, `title`: explanations, shown and on hover; `whole`: the
 *   slider sets whole numbers; `beside`, `below`: the controls of its automatic
 */

let dials = 0;

/** A labelled number with its slider. */
export class Dial {
  #options;
  #kind;
  #entry;
  #slider;
  #range = h("span", { class: "range" });
  #scale = h("div", { class: "scale", "aria-hidden": "true" });
  #presets = h("div", { class: "presets" });
  #taken = h("p", { class: "taken", role: "status" });
  #refused = h("p", { class: "refused", role: "alert" });
  #spanned = "";
  /** @type {SpanDocument} */
  #span = { low: 0, high: 0 };
  #value = NaN;
  #editing = false;
  #busy = false;
  /** The newest value requested while another one is being sent. @type {number | null} */
  #next = null;

  /** @param {Options} options */
  constructor(options) {
    this.#options = options;
    this.#kind = options.kind ?? "linear";
    dials += 1;
    const id = `dial-${dials}`;
    const { name, unit, of, note, beside, below } = options;
    this.#entry = h("input", {
      type: "number",
      id,
      step: "any",
      inputmode: "decimal",
      on: {
        input: () => this.#edit(),
        change: () => this.#typed(),
        blur: () => this.#leave(),
        keydown: (/** @type {KeyboardEvent} */ event) => this.#key(event),
      },
    });
    this.#slider = h("input", {
      type: "range",
      min: 0,
      max: WAY,
      step: 1,
      "aria-label": `${name} of the ${of}, slider`,
      on: { input: () => this.#slide(), change: () => this.#slid() },
    });
    this.element = h(
      "div",
      { class: "dial", role: "group", "aria-label": `${name} of the ${of}`, title: options.title },
      html`<div class="line">
        <label for=${id}>${name}</label>
        ${this.#range}
        ${beside}
        <span class="entry">${this.#entry}<span class="unit">${unit}</span></span>
      </div>`,
      html`<div class="track">${this.#slider}${this.#scale}</div>`,
      this.#presets,
      note ? html`<p class="aside-note">${note}</p>` : null,
      below,
      this.#taken,
      this.#refused,
    );
  }

  /**
   * @param {SpanDocument | undefined} span what the camera accepts
   * @param {number | undefined} value its current value
   * @param {boolean} open whether it accepts changes now
   * @param {boolean} [itself] whether the camera sets it itself: the value is shown and cannot be changed
   */
  update(span, value, open, itself = false) {
    const fixed = !span || span.high <= span.low;
    const locked = !open || fixed || itself;
    if (itself) this.#forget();
    this.#span = span ?? { low: 0, high: 0 };
    this.#value = value ?? NaN;
    this.#entry.disabled = this.#slider.disabled = locked;
    this.#slider.hidden = this.#scale.hidden = this.#presets.hidden = fixed;
    for (const button of this.#presets.querySelectorAll("button")) button.disabled = locked;
    this.#layScale();
    setText(this.#range, fixed ? (open ? "cannot be set" : "") : spanText(this.#span, this.#options.unit));
    this.#show();
  }

  /** Drop what was typed or taken before the camera set the value itself. */
  #forget() {
    this.#editing = false;
    setText(this.#taken, "");
    setText(this.#refused, "");
  }

  #layScale() {
    const spanned = JSON.stringify(this.#span);
    if (spanned === this.#spanned) return;
    this.#spanned = spanned;
    const { low, high } = this.#span;
    if (high <= low) return;
    const presets = (this.#options.presets ?? []).filter((preset) => preset >= low && preset <= high);
    const tick = (/** @type {number} */ value, /** @type {string} */ kind) => {
      const mark = h("span", { class: `tick ${kind}`, text: kind === "decade" ? plainly(value) : "" });
      mark.style.insetInlineStart = `${100 * shareOf(this.#span, this.#kind, value)}%`;
      return mark;
    };
    this.#scale.replaceChildren(
      ...presets.map((preset) => tick(preset, "preset")),
      ...(this.#kind === "log" ? decades(this.#span) : []).map((decade) => tick(decade, "decade")),
    );
    fill(
      this.#presets,
      ...presets.map((preset) =>
        textButton(String(preset), () => this.#send(preset), {
          kind: "chip",
          name: `${this.#options.name} of the ${this.#options.of}: ${preset} ${this.#options.unit}`,
        }),
      ),
    );
  }

  /** Show the camera's value, unless the operator is changing it. */
  #show() {
    if (this.#editing || this.#busy) return;
    const known = Number.isFinite(this.#value);
    const text = known ? plainly(this.#value) : "";
    if (this.#entry.value !== text) this.#entry.value = text;
    this.#place(known ? this.#value : this.#span.low);
  }

  /** @param {number} value */
  #place(value) {
    this.#slider.value = String(Math.round(WAY * shareOf(this.#span, this.#kind, value)));
    this.#slider.setAttribute("aria-valuetext", `${plainly(value)} ${this.#options.unit}`);
  }

  #edit() {
    this.#editing = true;
    if (Number.isFinite(this.#entry.valueAsNumber)) this.#place(this.#entry.valueAsNumber);
  }

  #slide() {
    this.#editing = true;
    const value = this.#slidTo();
    this.#entry.value = plainly(value);
    this.#slider.setAttribute("aria-valuetext", `${plainly(value)} ${this.#options.unit}`);
  }

  #slid() {
    void this.#send(this.#slidTo());
  }

  #slidTo() {
    const value = valueAt(this.#span, this.#kind, Number(this.#slider.value) / WAY);
    return this.#options.whole ? Math.round(value) : value;
  }

  #typed() {
    const value = this.#entry.valueAsNumber;
    if (Number.isFinite(value)) void this.#send(value);
    else this.#leave();
  }

  #leave() {
    this.#editing = false;
    this.#show();
  }

  /** @param {KeyboardEvent} event */
  #key(event) {
    if (event.key !== "Escape") return;
    this.#entry.value = "";
    this.#leave();
  }

  /** Send a value; of those that follow while one is being sent, send only the newest. @param {number} value */
  async #send(value) {
    this.#editing = false;
    this.#next = value;
    if (this.#busy) return;
    this.#busy = true;
    this.element.setAttribute("aria-busy", "true");
    try {
      while (this.#next !== null) {
        const asked = this.#next;
        this.#next = null;
        this.#showOutcome(asked, await this.#options.ask(asked));
      }
    } finally {
      this.#busy = false;
      this.element.removeAttribute("aria-busy");
      this.#show();
    }
  }

  /** @param {number} asked @param {Outcome} outcome */
  #showOutcome(asked, { taken, refusal }) {
    const { unit } = this.#options;
    if (taken !== null) this.#value = taken;
    setText(this.#refused, refusal ? sentence(refusal) : "");
    setText(
      this.#taken,
      taken !== null && snapped(asked, taken)
        ? `Requested ${plainly(asked)} ${unit}, the camera set ${plainly(taken)} ${unit}.`
            .replaceAll(" ,", ",")
            .replaceAll(" .", ".")
        : "",
    );
  }
}
