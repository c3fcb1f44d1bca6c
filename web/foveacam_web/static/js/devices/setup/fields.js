// The fields of the draft: each shows its value, changes it, and shows below its faults and the doctor's findings.

import { absent, html } from "../../elements/dom.js";
import { fieldId, notesAt, valueAt, withValue } from "./words.js";

/**
 * @import { ConsoleState } from "#page"
 * @import { SetupOrders } from "./orders.js"
 * @typedef {{path: string, label: string, unit?: string, title?: string, step?: string, kind?: "text" | "number" | "whole", empty?: boolean}} Field
 *   `empty`: whether nothing is a value
 */

/**
 * @param {Field} field
 * @param {ConsoleState} state
 * @param {SetupOrders} orders
 */
export function fieldOf(
  { path, label, unit = "", title, step = "any", kind = "number", empty = false },
  state,
  orders,
) {
  const { setup, advice } = state;
  if (!setup) return null;
  const id = fieldId(path);
  const notes = notesAt(path, setup, advice);
  const value = valueAt(setup.draft, path);
  const change = (/** @type {{currentTarget: HTMLInputElement}} */ { currentTarget: input }) => {
    const given = kind === "text" ? input.value.trim() : input.value === "" ? null : input.valueAsNumber;
    if ((given === null && !empty) || Number.isNaN(given)) input.value = String(value ?? "");
    else void orders.change((draft) => withValue(draft, path, kind === "whole" ? Math.round(Number(given)) : given));
  };
  return html`<div class="field" title=${title ?? absent}>
    <label for=${id}>${label}</label>
    <span class="entry"
      ><input
        id=${id} type=${kind === "text" ? "text" : "number"} step=${kind === "text" ? absent : kind === "whole" ? "1" : step}
        .value=${value === null ? "" : String(value)} aria-invalid=${notes.some(({ tone }) => tone === "bad") ? "true" : absent}
        aria-describedby=${notes.length > 0 ? `${id}-notes` : absent} @change=${change}
      />${unit && html`<span class="unit">${unit}</span>`}</span
    >
    ${notesOf(notes, `${id}-notes`)}
  </div>`;
}

/** @param {string} path @param {ConsoleState} state */
export function notesBeside(path, { setup, advice }) {
  return notesOf(notesAt(path, setup, advice), `${fieldId(path)}-notes`);
}

/** @param {import("./words.js").Note[]} notes @param {string} id */
function notesOf(notes, id) {
  if (notes.length === 0) return null;
  return html`<div class="notes" id=${id}>
    ${notes.map(({ tone, text }) => html`<p class="note ${tone}">${text}</p>`)}
  </div>`;
}

/**
 * @param {{id: string, label: string, choices: {value: string, text: string}[], value: string, change: (value: string) => unknown}} options
 */
export function chooser({ id, label, choices, value, change }) {
  return html`<label for=${id}>${label}</label>
    <select id=${id} .value=${value} @change=${(/** @type {{currentTarget: HTMLSelectElement}} */ { currentTarget }) => void change(currentTarget.value)}>
      ${choices.map((choice) => html`<option value=${choice.value} ?selected=${choice.value === value}>${choice.text}</option>`)}
    </select>`;
}
