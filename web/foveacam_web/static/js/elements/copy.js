// Copies a text that the page shows.

import { setText } from "./dom.js";

/**
 * Copy the text of the `pre` in the same `.copied` element as the button that was clicked, and say so beside the button.
 * @param {{currentTarget: HTMLElement}} event
 */
export async function copyCode({ currentTarget }) {
  const status = /** @type {HTMLElement} */ (currentTarget.nextElementSibling);
  const code = currentTarget.closest(".copied")?.querySelector("pre") ?? status;
  try {
    await navigator.clipboard.writeText(code.textContent ?? "");
    setText(status, "Copied");
  } catch {
    getSelection()?.selectAllChildren(code); // no clipboard over plain HTTP from another machine
    setText(status, "Selected: copy it with the keyboard");
  }
}
