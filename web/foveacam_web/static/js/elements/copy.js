// Copies a text that the page shows.

import { html, setText } from "./dom.js";
import { textButton } from "./parts.js";

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

/** Build lines of code with a button that copies them. @param {string} code @param {string} label for screen readers */
export function copiedCode(code, label) {
  return html`<div class="stack copied">
    <pre class="code scroll-x" tabindex="0" aria-label=${label}>${code}</pre>
    <p class="actions">
      ${textButton("Copy", copyCode, { picture: "file" })}
      <span class="why" role="status"></span>
    </p>
  </div>`;
}
