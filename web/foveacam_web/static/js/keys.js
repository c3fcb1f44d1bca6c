// The page's keyboard: Space stops, Escape cancels or closes, single letters switch things.

/**
 * @typedef {Record<string, () => void>} Keys what each key does, by its `event.key` in lower case
 */

/**
 * Listen to the whole page.
 * @param {{keys: Keys, stop: () => void, escape: () => void, letters: () => boolean}} actions
 *   `letters` says whether single-letter keys are wanted
 */
export function listenToKeys({ keys, stop, escape, letters }) {
  document.addEventListener("keydown", (event) => {
    if (event.key === " " && !typing(event.target)) {
      event.preventDefault();
      if (!event.repeat) stop();
      return;
    }
    if (event.defaultPrevented || event.ctrlKey || event.metaKey || event.altKey || typing(event.target)) return;
    if (event.key === "Escape") return escape();
    const act = keys[event.key.toLowerCase()];
    if (!act || !letters() || document.querySelector("dialog[open]")) return;
    event.preventDefault();
    act();
  });
  // A focused button acts when Space is released; it must not act as well as stop.
  document.addEventListener("keyup", (event) => event.key === " " && !typing(event.target) && event.preventDefault());
}

/**
 * Whether the key goes into a control that needs it itself.
 * @param {EventTarget | null} target
 */
function typing(target) {
  return target instanceof Element && target.closest("input, textarea, select, [contenteditable]") !== null;
}
