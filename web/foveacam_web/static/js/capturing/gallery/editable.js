// A text line that is edited in place: saved on blur or Enter, reset by Escape or a refusal.

import { h, html, setText } from "../../elements/dom.js";

/**
 * @import { CollectionOrders } from "./collection_orders.js"
 * @import { EntryReader } from "./collection_readers.js"
 */

let lists = 0;

/**
 * Return the saving of one line of an entry.
 * @template {{id: string, name: string}} T
 * @param {"label" | "licence"} key
 * @param {string} id
 * @param {{orders: CollectionOrders<T>, reader: EntryReader<T>}} context
 */
export function saveOf(key, id, { orders, reader }) {
  return async (/** @type {string} */ value) => {
    const now = await orders.describe(id, { [key]: value });
    if (now) reader.adopt(now);
    return now !== null;
  };
}

/**
 * Return a function that shows a value and returns the field.
 * @param {string} label
 * @param {{save: (value: string) => Promise<boolean>, usual?: string[], hint?: string}} options `save`: whether the server accepted it
 */
export function makeEditable(label, { save, usual = [], hint = "" }) {
  lists += 1;
  const id = `editable-${lists}`;
  const list = usual.length > 0 ? `${id}-usual` : undefined;
  const status = h("span", { class: "why", role: "status" });
  let kept = "";
  let saving = false;
  const keep = async () => {
    const wanted = input.value.trim();
    if (wanted === kept || saving) return;
    saving = true;
    setText(status, "Saving …");
    const taken = await save(wanted);
    saving = false;
    if (taken) kept = wanted;
    else if (document.activeElement !== input) input.value = kept;
    setText(status, taken ? "Saved" : "Not saved");
    if (taken && document.activeElement !== input) void keep(); // it was edited again and left meanwhile
  };
  const on = {
    change: () => void keep(),
    input: () => setText(status, ""),
    keydown: (/** @type {KeyboardEvent} */ event) => {
      if (event.key === "Enter") void keep();
      if (event.key !== "Escape") return;
      input.value = kept;
      input.blur();
    },
  };
  const input = h("input", { type: "text", id, maxlength: 400, placeholder: hint, list, autocomplete: "off", on });
  const options = html`<datalist id=${list ?? ""}>${usual.map((value) => html`<option value=${value}></option>`)}</datalist>`;
  const field = h("div", { class: "field" }, html`<label for=${id}>${label}</label>`, input, status, list && options);
  return (/** @type {string} */ value) => {
    const untouched = input.value === kept;
    kept = value;
    if (untouched && !saving) input.value = value;
    return field;
  };
}
