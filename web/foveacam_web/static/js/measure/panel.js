// Shows the list of measurements: names, values, the details of the selected one, export.

import { fill, h, html, need, say } from "../dom.js";
import { icon } from "../icons.js";
import { shownOf } from "./orders.js";
import { profilePlot } from "./plot.js";
import { factsOf, KINDS, valueText } from "./words.js";

/**
 * @import { MeasurementDocument } from "#api"
 * @import { Store } from "../store.js"
 * @import { MeasureOrders } from "./orders.js"
 * @typedef {{element: HTMLLIElement, label: HTMLInputElement, value: HTMLElement, more: HTMLElement, pick: HTMLButtonElement, measured: MeasurementDocument, told: string}} Row
 */

/**
 * @param {HTMLElement} place
 * @param {{store: Store, orders: MeasureOrders, exports: HTMLElement}} context
 */
export function mountMeasurements(place, { store, orders, exports }) {
  const tabs = mountListTabs();
  const list = h("ul", { class: "targets measurements" });
  const empty = h("p", { class: "empty" });
  fill(place, list, empty);
  const links = ["csv", "json"].map((kind) =>
    h("a", {
      class: "aside",
      href: `/api/v1/measurements.${kind}`,
      download: `measurements.${kind}`,
      text: kind.toUpperCase(),
      title: `Save all as ${kind.toUpperCase()}`,
    }),
  );
  fill(exports, links);
  tabs.onChoose((index) => (exports.hidden = index !== 1));
  let chosen = "";
  store.on(["measuring", "selected_measurement"], ({ measuring, selected_measurement }) => {
    const now = measuring ? measuring.view + (selected_measurement ?? "") : "";
    if (now && now !== chosen) tabs.choose(1); // a new measurement appears there
    chosen = now;
  });
  /** @type {Map<string, Row>} */
  const rows = new Map();
  store.on(["measurements", "hidden_measurements", "selected_measurement"], (state) => {
    const shown = shownOf(state);
    for (const [id, row] of rows) {
      if (shown.some((measured) => measured.id === id)) continue;
      row.element.remove();
      rows.delete(id);
    }
    shown.forEach((measured, index) => {
      const row = rows.get(measured.id) ?? makeRow(measured, store, orders);
      rows.set(measured.id, row);
      updateRow(row, measured, measured.id === state.selected_measurement);
      if (list.children[index] !== row.element) list.insertBefore(row.element, list.children[index] ?? null);
    });
    empty.hidden = shown.length > 0;
    links.forEach((link) => (link.hidden = shown.length === 0));
    say(
      empty,
      state.measurements === null
        ? "Loading …"
        : "Nothing measured yet. Press M, or the ruler on a view, then click in what the foveae have looked at.",
    );
  });
}

/** Build the tabs for the lists of targets and measurements. */
function mountListTabs() {
  const tabs = [need("tab-targets"), need("tab-measurements")];
  const panels = [need("targets"), need("measurements")];
  /** @type {(index: number) => void} */
  let told = () => {};
  const choose = (/** @type {number} */ chosen) => {
    tabs.forEach((tab, index) => {
      tab.setAttribute("aria-selected", String(index === chosen));
      tab.tabIndex = index === chosen ? 0 : -1;
    });
    panels.forEach((panel, index) => (panel.hidden = index !== chosen));
    told(chosen);
  };
  tabs.forEach((tab, index) => {
    tab.addEventListener("click", () => choose(index));
    tab.addEventListener("keydown", (event) => {
      if (event.key !== "ArrowLeft" && event.key !== "ArrowRight") return;
      choose(1 - index);
      tabs[1 - index]?.focus();
    });
  });
  choose(0);
  return { choose, onChoose: (/** @type {(index: number) => void} */ listener) => (told = listener) };
}

/**
 * @param {MeasurementDocument} measured
 * @param {Store} store
 * @param {MeasureOrders} orders
 * @returns {Row}
 */
function makeRow(measured, store, orders) {
  const label = h("input", {
    class: "label",
    type: "text",
    "aria-label": "Name of the measurement",
    maxlength: "80",
    spellcheck: "false",
    autocomplete: "off",
  });
  const button = (
    /** @type {string} */ name,
    /** @type {import("../icons.js").IconName} */ picture,
    /** @type {() => void} */ act,
  ) =>
    h("button", { type: "button", class: "tool", "aria-label": name, title: name, on: { click: act } }, icon(picture));
  const toggle = () =>
    store.set({ selected_measurement: store.state.selected_measurement === row.measured.id ? null : row.measured.id });
  /** @type {Row} */
  const row = {
    element: h("li", {}),
    label,
    measured,
    told: "",
    value: h("span", { class: "distance number" }),
    more: h("div", { class: "more" }),
    pick: button("Details", "info", toggle),
  };
  row.element.append(
    label,
    row.value,
    h(
      "span",
      { class: "tools" },
      row.pick,
      button("Delete", "trash", () => orders.remove(row.measured)),
    ),
    row.more,
  );
  label.addEventListener("change", () => void orders.rename(row.measured.id, label.value.trim() || row.measured.label));
  label.addEventListener("keydown", (event) => {
    if (event.key === "Escape") label.value = row.measured.label;
    if (event.key === "Escape" || event.key === "Enter") label.blur();
    event.stopPropagation(); // keys typed into the name are not the console's
  });
  row.element.addEventListener(
    "click",
    (event) => (event.target === row.element || event.target === row.value) && toggle(),
  );
  return row;
}

/**
 * @param {Row} row
 * @param {MeasurementDocument} measured
 * @param {boolean} selected
 */
function updateRow(row, measured, selected) {
  row.measured = measured;
  row.element.classList.toggle("selected", selected);
  row.pick.setAttribute("aria-pressed", String(selected));
  if (document.activeElement !== row.label && row.label.value !== measured.label) row.label.value = measured.label;
  row.label.title = measured.label;
  say(row.value, valueText(measured));
  row.value.title = KINDS[measured.kind].title;
  if (selected && row.more.hidden) row.element.parentElement?.parentElement?.scrollTo({ top: row.element.offsetTop });
  row.more.hidden = !selected;
  if (!selected || row.told === measured.id) return;
  row.told = measured.id; // only the name of a measurement can change
  fill(
    row.more,
    measured.profile && profilePlot(measured.profile),
    html`<dl class="facts">
      ${factsOf(measured).flatMap(([name, value]) => [html`<dt>${name}</dt>`, html`<dd>${value}</dd>`])}
    </dl>`,
  );
}
