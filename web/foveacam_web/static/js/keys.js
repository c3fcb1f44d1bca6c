// Handles the page's keys: Space stops, Escape cancels or closes, single letters switch things. The 3D frame is another
// document that may have the focus, so its keys are handled as well, above all the stop.

/**
 * @typedef {{
 *   keys: Record<string, () => void>, stop: () => void, escape: () => void, letters: () => boolean, palette?: () => void
 * }} Actions `keys`: what each key does, by its `event.key` in lower case; `letters`: whether single keys are wanted;
 *   `palette`: what Ctrl-K does
 */

/** The key handler of one page. */
export class Keyboard {
  #actions;

  /** @param {Actions} actions */
  constructor(actions) {
    this.#actions = actions;
    this.listenTo(document);
  }

  /** @param {Document} of the page's own, or that of a frame of the same origin */
  listenTo(of) {
    of.addEventListener("keydown", (event) => this.#down(event), { capture: of !== document });
    // A focused button acts when Space is released; Space must only stop.
    of.addEventListener("keyup", (event) => event.key === " " && !takesSpace(event.target) && event.preventDefault());
  }

  /** @param {KeyboardEvent} event */
  #down(event) {
    if (event.key === " " && !takesSpace(event.target)) {
      event.preventDefault();
      if (!event.repeat) this.#actions.stop();
      return;
    }
    if (event.key.toLowerCase() === "k" && (event.ctrlKey || event.metaKey) && this.#actions.palette) {
      event.preventDefault();
      if (!document.querySelector("dialog[open]")) this.#actions.palette();
      return;
    }
    if (typing(event.target)) return;
    if (event.defaultPrevented || event.ctrlKey || event.metaKey || event.altKey) return;
    const sheet = document.querySelector("dialog[open]");
    if (event.key === "Escape") {
      if (sheet instanceof HTMLDialogElement) sheet.close();
      else this.#actions.escape();
      return;
    }
    const act = this.#actions.keys[event.key.toLowerCase()];
    if (!act || sheet || !this.#actions.letters()) return;
    event.preventDefault();
    act();
  }
}

/**
 * Return whether the focused control needs the key itself. Elements of a frame are of another realm: no instanceof.
 * @param {EventTarget | null} target
 */
function typing(target) {
  const element = /** @type {Element | null} */ (target);
  return Boolean(element?.closest?.("input, textarea, select, [contenteditable]"));
}

/**
 * Return whether the control needs the space. Sliders do not, so that it stops the mirrors from there as well.
 * @param {EventTarget | null} target
 */
function takesSpace(target) {
  const element = /** @type {Element | null} */ (target);
  return typing(target) && !element?.closest?.("input[type=range]");
}
