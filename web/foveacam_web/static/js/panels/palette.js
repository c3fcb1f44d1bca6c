// Builds the command palette (Ctrl-K), which finds pages, commands and targets by parts of their names.

import { fill, h, html, update } from "../elements/dom.js";
import { ACTIVITIES, MORE } from "./navigation.js";
import { fitting } from "./palette_words.js";

/**
 * @import { Store } from "#console"
 * @import { Order } from "./navigation.js"
 * @typedef {Order & {kind: string}} Entry `kind`: what it is
 */

const MOST_SHOWN = 12;

/**
 * Build the palette and return the function that opens it.
 * @param {{store: Store, orders: Order[], lookAt: (target: import("#api").TargetDocument) => void}} context
 */
export function makePalette({ store, orders, lookAt }) {
  const input = h("input", {
    type: "search",
    role: "combobox",
    placeholder: "Page, command or target",
    "aria-label": "Find a page, command or target",
    "aria-expanded": "true",
    "aria-controls": "palette-list",
    "aria-autocomplete": "list",
    autocomplete: "off",
    spellcheck: "false",
  });
  const list = h("ul", { id: "palette-list", role: "listbox", "aria-label": "What fits" });
  const dialog = h("dialog", { class: "sheet palette", "aria-label": "Palette" });
  fill(dialog, input, list);
  document.body.append(dialog);
  /** @type {Entry[]} */
  let shown = [];
  let chosen = 0;

  const entries = () => [
    ...[...ACTIVITIES, ...MORE.flatMap(([, places]) => places)].map(({ label, hint, href }) => ({
      kind: "page",
      label,
      hint,
      act: () => location.assign(href),
    })),
    ...orders.map((order) => ({ kind: "command", ...order })),
    ...(store.state.targets ?? []).map((target) => ({
      kind: "target",
      label: target.label,
      hint: "Look there again",
      act: () => lookAt(target),
    })),
  ];
  const draw = () => {
    input.setAttribute("aria-activedescendant", shown.length > 0 ? `palette-${chosen}` : "");
    const rows = shown.map(
      (entry, at) => html`<li
        id=${`palette-${at}`} role="option" aria-selected=${String(at === chosen)} @click=${() => run(entry)}
      ><b>${entry.label}</b><span class="hint">${entry.hint ?? ""}</span>${entry.keys && html`<kbd>${entry.keys}</kbd>`}<span class="kind">${entry.kind}</span></li>`,
    );
    update(list, shown.length > 0 ? html`${rows}` : html`<li class="empty">Nothing is called that.</li>`);
    list.children[chosen]?.scrollIntoView?.({ block: "nearest" });
  };
  const find = () => {
    shown = fitting(input.value, entries()).slice(0, input.value ? MOST_SHOWN : 99);
    chosen = 0;
    draw();
  };
  const run = (/** @type {Entry} */ entry) => {
    dialog.close();
    entry.act();
  };
  input.addEventListener("input", find);
  input.addEventListener("keydown", (event) => {
    const step = { ArrowDown: 1, ArrowUp: -1 }[event.key];
    const entry = shown[chosen];
    if (step && shown.length > 0) chosen = (chosen + step + shown.length) % shown.length;
    else if (event.key === "Enter" && entry) run(entry);
    else if (event.key === "Escape") dialog.close();
    else return;
    event.preventDefault();
    if (step) draw();
  });
  dialog.addEventListener("click", (event) => event.target === dialog && dialog.close());
  return () => {
    if (dialog.open) return;
    input.value = "";
    dialog.showModal();
    find();
  };
}
