// Shows the list of measurements: names, values, the details of the selected one, export.

import { html, repeat, update } from "../../elements/dom.js";
import { namedRow } from "../../panels/named_row.js";
import { toolButton } from "../../elements/parts.js";
import { shownOf } from "./state.js";
import { profilePlot } from "./plot.js";
import { doubtWords, factsOf, KINDS, valueText } from "./words.js";
import { API } from "../../root.js";
import { waiting } from "../../elements/waiting.js";

/**
 * @import { MeasurementDocument } from "#api"
 * @import { ConsoleState, Store } from "#console"
 * @import { MeasureOrders } from "./orders.js"
 * @typedef {{store: Store, orders: MeasureOrders}} Context
 */

/** @param {HTMLElement} place @param {Context & {exports: HTMLElement, show: () => void}} context `show`: open its tab */
export function mountMeasurements(place, { store, orders, exports, show }) {
  let chosen = "";
  store.on(["measuring", "selected_measurement"], ({ measuring, selected_measurement }) => {
    const now = measuring ? measuring.view + (selected_measurement ?? "") : "";
    if (now && now !== chosen) show(); // a new measurement appears there
    chosen = now;
  });
  let before = store.state.selected_measurement;
  store.on(["measurements", "hidden_measurements", "selected_measurement"], (state) => {
    const empty = shownOf(state).length === 0;
    update(
      exports,
      ["csv", "json"].map((kind) => exportLink(kind, empty)),
    );
    update(place, listOf(state, { store, orders }));
    const row = place.querySelector("li.selected");
    if (state.selected_measurement !== before && row) scrollTo(place, row);
    before = state.selected_measurement;
  });
}

/** Scroll a list, and not the page, to one of its rows. @param {HTMLElement} place @param {Element} row */
function scrollTo(place, row) {
  place.scrollTop += row.getBoundingClientRect().top - place.getBoundingClientRect().top;
}

/** @param {string} kind @param {boolean} hidden */
function exportLink(kind, hidden) {
  const name = kind.toUpperCase();
  return html`<a
    class="aside" href="${API}/measurements.${kind}" download="measurements.${kind}" title="Save all as ${name}"
    ?hidden=${hidden}
  >${name}</a>`;
}

/** @param {ConsoleState} state @param {Context} context */
function listOf(state, context) {
  const shown = shownOf(state);
  const row = (/** @type {MeasurementDocument} */ measured) =>
    rowOf(measured, measured.id === state.selected_measurement, context);
  const empty = html`<p class="empty" ?hidden=${shown.length > 0}>
    Nothing measured yet. Press M, or the ruler on a view, then click in what the foveae have looked at.
  </p>`;
  return html`<ul class="targets measurements">${repeat(shown, ({ id }) => id, row)}</ul>
    ${state.measurements === null ? waiting("Loading the measurements") : empty}`;
}

/** @param {MeasurementDocument} measured @param {boolean} selected @param {Context} context */
function rowOf(measured, selected, { store, orders }) {
  const { id, kind, profile } = measured;
  const doubt = doubtWords(measured);
  const toggle = () => store.set({ selected_measurement: store.state.selected_measurement === id ? null : id });
  const facts = () =>
    html`${profile && profilePlot(profile)}
      <dl class="facts">
        ${factsOf(measured).flatMap(([name, value]) => [html`<dt>${name}</dt>`, html`<dd>${value}</dd>`])}
      </dl>`;
  return namedRow(measured, {
    what: "measurement",
    selected,
    values: html`<span class=${`distance number${doubt ? " warn-text" : ""}`} title=${doubt || KINDS[kind].title}>
      ${valueText(measured)}
    </span>`,
    tools: [
      toolButton("Details", "info", toggle, { pressed: selected }),
      toolButton("Delete", "trash", () => orders.remove(measured)),
    ],
    more: html`<div class="more" ?hidden=${!selected}>${selected && facts()}</div>`,
    select: toggle,
    rename: (label) => orders.rename(id, label),
  });
}
