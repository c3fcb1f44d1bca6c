// A number of a plan: field and slider, which report each change at once.

import { h, html } from "../../elements/dom.js";
import { plainly, shareOf, valueAt, WAY } from "../../devices/rig/scale.js";
import { keptButton } from "../../elements/parts.js";

/** @import { NumberSetting } from "./settings.js" */

let slides = 0;

/**
 * @param {NumberSetting} setting
 * @param {{place: HTMLElement, changed: (value: number) => void, below?: HTMLElement}} options `place`: the element of its error message
 */
export function makeSlide({ label, unit, low, high, kind, presets = [] }, { place, changed, below }) {
  slides += 1;
  const id = `slide-${slides}`;
  const span = { low, high };
  const entry = h("input", {
    type: "number",
    id,
    step: "any",
    inputmode: "decimal",
    "aria-describedby": `${id}-refused`,
    on: { input: () => typed() },
  });
  const slider = h("input", {
    type: "range",
    min: 0,
    max: WAY,
    step: 1,
    "aria-label": `${label}, slider`,
    on: { input: () => slid() },
  });
  place.id = `${id}-refused`;
  const typed = () => {
    if (Number.isFinite(entry.valueAsNumber)) follow(entry.valueAsNumber);
    changed(entry.valueAsNumber);
  };
  const slid = () => set(valueAt(span, kind, slider.valueAsNumber / WAY));
  const set = (/** @type {number} */ value) => {
    show(value);
    changed(value);
  };
  const follow = (/** @type {number} */ value) => {
    slider.value = String(Math.round(WAY * shareOf(span, kind, value)));
    slider.setAttribute("aria-valuetext", `${plainly(value)} ${unit}`);
    for (const { button, preset } of chips) button.setAttribute("aria-pressed", String(preset === value));
  };
  const show = (/** @type {number} */ value) => {
    if (document.activeElement !== entry || entry.valueAsNumber !== value)
      entry.value = Number.isFinite(value) ? String(value) : "";
    follow(value);
  };
  const chips = presets.map(({ text, value }) => ({
    preset: value,
    button: keptButton(text, () => set(value), { kind: "chip" }),
  }));
  const element = h(
    "div",
    { class: "dial asked-for", role: "group", "aria-label": label },
    html`<div class="line">
      <label for=${id}>${label}</label>
      <span class="entry">${entry}<span class="unit">${unit}</span></span>
    </div>`,
    slider,
    chips.length > 0 ? html`<div class="presets">${chips.map(({ button }) => button)}</div>` : null,
    below,
    place,
  );
  return {
    element,
    show,
    enable: (/** @type {boolean} */ on) => {
      entry.disabled = slider.disabled = !on;
    },
  };
}
