// A row of a list: a name that is edited in place, values, buttons. A click beside them selects it.

import { absent, html } from "../elements/dom.js";

/**
 * @param {{label: string}} entry
 * @param {{
 *   what: string, selected: boolean, basis?: string, values: unknown, tools: unknown, more?: unknown, select: () => void,
 *   rename: (label: string) => Promise<unknown>
 * }} parts `what`: the kind of entry; `rename` resolves with null when it was refused
 */
export function namedRow({ label }, { what, selected, basis, values, tools, more, select, rename }) {
  const clicked = (/** @type {{target: Element}} */ { target }) => {
    if (!target.closest(".label, .tools, .more")) select();
  };
  return html`<li class=${selected ? "selected" : ""} data-basis=${basis ?? absent} @click=${clicked}>
    ${nameField(label, { what, rename })}
    ${values}
    <span class="tools">${tools}</span>
    ${more}
  </li>`;
}

/**
 * Build a name that is edited in place.
 * @param {string} label
 * @param {{what: string, rename: (label: string) => Promise<unknown>}} parts
 */
export function nameField(label, { what, rename }) {
  const changed = async (/** @type {{target: HTMLInputElement}} */ { target }) => {
    if ((await rename(target.value.trim() || label)) === null) target.value = label;
  };
  const key = (/** @type {KeyboardEvent & {target: HTMLInputElement}} */ event) => {
    if (event.key === "Escape") event.target.value = label;
    if (event.key === "Escape" || event.key === "Enter") event.target.blur();
    event.stopPropagation(); // keys typed into the name are not the console's
  };
  return html`<input
    class="label" type="text" aria-label="Name of the ${what}" title=${label} maxlength="80" spellcheck="false"
    autocomplete="off" .value=${label} @change=${changed} @keydown=${key}
  />`;
}
