// The tabs of the views derived from both eyes; those that do not fit stand in a list behind them.

import { fill, h } from "../elements/dom.js";
import { VIEWS } from "./pane.js";
import { DERIVED } from "./views.js";

/**
 * @import { ViewName } from "#page"
 * @import { Views } from "./views.js"
 */

/** Build tabs and panes. @param {Views} views */
export function derivedViews(views) {
  const tabs = DERIVED.map((name) =>
    h("button", {
      type: "button",
      role: "tab",
      id: `tab-${name}`,
      text: VIEWS[name].title,
      on: { click: () => choose(name) },
    }),
  );
  const rest = h("select", { class: "rest", "aria-label": "Other views of both eyes", hidden: true });
  rest.addEventListener("change", () => choose(/** @type {ViewName} */ (rest.value)));
  const choose = (/** @type {ViewName} */ chosen) => {
    views.showDerived(chosen);
    DERIVED.forEach((name, index) => {
      tabs[index]?.setAttribute("aria-selected", String(name === chosen));
      if (tabs[index]) tabs[index].tabIndex = name === chosen ? 0 : -1;
    });
    fold();
  };
  const list = h("div", { class: "tabs", role: "tablist", "aria-label": "Views of both eyes" }, tabs);
  const fold = () => foldTabs({ list, tabs, rest, chosen: views.derived });
  list.addEventListener("keydown", (event) => {
    const step = event.key === "ArrowRight" ? 1 : event.key === "ArrowLeft" ? -1 : 0;
    const next = DERIVED[(DERIVED.indexOf(views.derived) + step + DERIVED.length) % DERIVED.length];
    if (step === 0 || !next) return;
    choose(next);
    const tab = tabs[DERIVED.indexOf(next)];
    (tab?.hidden ? rest : tab)?.focus();
  });
  for (const name of DERIVED) {
    views.pane(name).element.setAttribute("role", "tabpanel");
    views.pane(name).element.setAttribute("aria-labelledby", `tab-${name}`);
  }
  choose(views.derived);
  const bar = h("div", { class: "tab-bar" }, list, rest);
  new ResizeObserver(fold).observe(bar);
  return h(
    "div",
    { class: "derived" },
    bar,
    h(
      "div",
      { class: "derived-panes" },
      DERIVED.map((name) => views.pane(name).element),
    ),
  );
}

/**
 * Hide the tabs that do not fit, and list them; the list shows the chosen one if it is among them.
 * @param {{list: HTMLElement, tabs: HTMLElement[], rest: HTMLSelectElement, chosen: ViewName}} what
 */
function foldTabs({ list, tabs, rest, chosen }) {
  for (const tab of tabs) tab.hidden = false;
  rest.hidden = true; // so that the tabs have all of the room while they are measured
  if (list.scrollWidth <= list.clientWidth) return;
  rest.hidden = false;
  const room = list.clientWidth; // less than before: the list of the others takes its part
  const left = list.getBoundingClientRect().left;
  const ends = tabs.map((tab) => tab.getBoundingClientRect().right - left);
  const others = DERIVED.filter((_, index) => (ends[index] ?? 0) > room);
  tabs.forEach((tab, index) => (tab.hidden = (ends[index] ?? 0) > room));
  const option = (/** @type {ViewName} */ name) => h("option", { value: name, text: VIEWS[name].title });
  fill(rest, h("option", { value: "", text: "More", disabled: true }), ...others.map(option));
  rest.value = others.includes(chosen) ? chosen : "";
  rest.classList.toggle("chosen", rest.value !== "");
}
