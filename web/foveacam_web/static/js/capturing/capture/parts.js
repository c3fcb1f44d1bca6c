// Small parts of the capture page: messages beside fields, a choice in a row, a text line, numbers as chips.

import { fill, h, html, setText } from "../../elements/dom.js";
import { number, sentence } from "../../elements/format.js";
import { icon } from "../../elements/icons.js";
import { textButton } from "../../elements/parts.js";

/** @import { Trouble } from "#page" */

/** The messages beside the fields. */
export class Troubles {
  /** @type {Map<string, HTMLElement>} */
  #places = new Map();

  /** Return the message element of a field. @param {string} name */
  place(name) {
    const place = h("p", { class: "refused", role: "alert", data: { about: name } });
    this.#places.set(name, place);
    return place;
  }

  /**
   * Show these messages and clear all others; return those whose field does not exist or is not visible.
   * @param {Trouble[]} troubles
   */
  show(troubles) {
    /** @type {Map<string, string[]>} */
    const messages = new Map();
    const homeless = [];
    for (const { place, words } of troubles) {
      const seen = place !== null && this.#places.has(place) && !this.#places.get(place)?.closest("[data-off]");
      if (!seen) homeless.push(words);
      else messages.set(place, [...(messages.get(place) ?? []), sentence(words)]);
    }
    for (const [name, element] of this.#places) {
      setText(element, (messages.get(name) ?? []).join(" "));
      element.closest(".asked-for")?.classList.toggle("at-fault", messages.has(name));
    }
    return homeless;
  }
}

/** Group fields with their message. @param {(Node | null)[]} fields @param {...(Node | null)} below */
export function asked(fields, ...below) {
  return html`<div class="asked-for"><div class="fields">${fields}</div>${below}</div>`;
}

/** @param {number} value */
function decimals(value) {
  return Math.min(3, (String(value).split(".")[1] ?? "").length);
}

let choices = 0;

/**
 * Build a choice of a few options, all of them visible.
 * @template {string} T
 * @param {string} label
 * @param {[T, string][]} options value and text; the first is selected
 */
export function segments(label, options) {
  choices += 1;
  const name = `choice-${choices}`;
  const inputs = options.map(([value], index) =>
    h("input", { type: "radio", name, value, checked: index === 0, id: `${name}-${value}` }),
  );
  const element = h(
    "div",
    { class: "segments", role: "radiogroup", "aria-label": label },
    options.map(([value, text], index) => [inputs[index], html`<label for="${name}-${value}">${text}</label>`]).flat(),
  );
  const put = (/** @type {T} */ value) => {
    for (const input of inputs) input.checked = input.value === value;
  };
  return {
    element,
    value: () => /** @type {T} */ (inputs.find(({ checked }) => checked)?.value ?? options[0]?.[0]),
    put,
  };
}

/** @param {string} label @param {{value?: string, placeholder?: string}} [options] */
export function textField(label, { value = "", placeholder } = {}) {
  choices += 1;
  const id = `text-${choices}`;
  const input = h("input", { type: "text", id, value, placeholder, autocomplete: "off", spellcheck: "false" });
  return {
    element: h("div", { class: "field wide-field" }, html`<label for=${id}>${label}</label>`, input),
    input,
    value: () => input.value,
  };
}

/**
 * Build an ordered list of numbers: add one, remove one, or replace the list.
 * @param {{label: string, unit: string, empty: string, lists: {text: string, values: readonly number[]}[], changed: () => void}} options
 *   `empty`: the meaning of an empty list
 */
export function numberChips({ label, unit, empty, lists, changed }) {
  choices += 1;
  const id = `chips-${choices}`;
  /** @type {number[]} */
  let values = [];
  const list = h("ul", { class: "chips", "aria-label": label });
  const input = h("input", { type: "number", id, step: "any", inputmode: "decimal" });
  const put = (/** @type {readonly number[]} */ next) => {
    values = [...next];
    fill(
      list,
      values.length === 0 ? html`<li class="none">${empty}</li>` : null,
      values.map(
        (value, index) =>
          html`<li>
          <button
            type="button" class="chip" aria-label="${label}: take away ${value} ${unit}"
            @click=${() => set(values.filter((_, other) => other !== index))}
          >
            ${number(value, decimals(value))}
            ${icon("close")}
          </button>
        </li>`,
      ),
    );
  };
  const set = (/** @type {readonly number[]} */ next) => {
    put(next);
    changed();
  };
  const add = () => {
    if (Number.isFinite(input.valueAsNumber)) set([...values, input.valueAsNumber]);
    input.value = "";
    input.focus();
  };
  input.addEventListener("keydown", (event) => event.key === "Enter" && add());
  const button = (/** @type {string} */ text, /** @type {() => void} */ act) => textButton(text, act);
  const element = h(
    "div",
    { class: "field chips-field" },
    html`<label for=${id}>${label}</label>`,
    list,
    html`<span class="entry">
      ${input}
      <span class="unit">${unit}</span>
      ${button("Add", add)}
      ${lists.map(({ text, values: whole }) => button(text, () => set(whole)))}
    </span>`,
  );
  put([]);
  return { element, value: () => values, put };
}

/**
 * Combine fields by their names in the draft: read and set them together.
 * @param {Record<string, {value: () => any, put: (value: any) => void}>} fields `any`: each field has its own type
 */
export function named(fields) {
  return {
    read: () => Object.fromEntries(Object.entries(fields).map(([name, { value }]) => [name, value()])),
    put: (/** @type {Record<string, any>} */ draft) => {
      for (const [name, field] of Object.entries(fields)) field.put(draft[name]);
    },
  };
}
