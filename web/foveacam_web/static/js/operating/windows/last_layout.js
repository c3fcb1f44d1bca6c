// Remembers the layout of the window that was divided last in this browser.

import { layoutOf, layoutText } from "./layout.js";

/** @import { Layout } from "#page" */

const KEY = "foveacam.layout";

/** Return the last layout as text; null before the first. */
export function lastLayout() {
  try {
    const kept = localStorage.getItem(KEY);
    return kept && layoutOf(kept) ? kept : null;
  } catch {
    return null; // private mode
  }
}

/** Remember a layout. @param {Layout} layout */
export function keepLayout(layout) {
  try {
    localStorage.setItem(KEY, layoutText(layout));
  } catch {
    // private mode: it is not remembered
  }
}
