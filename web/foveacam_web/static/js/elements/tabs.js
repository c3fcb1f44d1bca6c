// Tabs of the page's HTML: one of several panels is shown.

import { need } from "./dom.js";

/**
 * Connect tabs with their panels and show the first; return a function that shows one.
 * @param {string[]} names of the panels; the tab of each has the id tab-NAME
 * @param {(index: number) => void} chosen called with the shown one
 */
export function connectTabs(names, chosen) {
  const panels = names.map(need);
  const tabs = names.map((name) => need(`tab-${name}`));
  const choose = (/** @type {number} */ index) => {
    tabs.forEach((tab, other) => {
      tab.setAttribute("aria-selected", String(other === index));
      tab.tabIndex = other === index ? 0 : -1;
    });
    panels.forEach((panel, other) => (panel.hidden = other !== index));
    chosen(index);
  };
  tabs.forEach((tab, index) => {
    tab.addEventListener("click", () => choose(index));
    tab.addEventListener("keydown", (event) => {
      if (event.key !== "ArrowLeft" && event.key !== "ArrowRight") return;
      const step = event.key === "ArrowLeft" ? tabs.length - 1 : 1;
      const next = (index + step) % tabs.length;
      choose(next);
      tabs[next]?.focus();
    });
  });
  choose(0);
  return choose;
}
