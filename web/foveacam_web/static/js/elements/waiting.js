// The note of whatever is awaited: what it is, for how long already, and how to cancel it where that is possible.

import { fill, h, html, setText } from "./dom.js";

const TOLD_AFTER_S = 3;
const LONG_S = 10;

class WaitingNote extends HTMLElement {
  #words = h("span", {});
  #time = h("span", { class: "number", "aria-hidden": "true" });
  /** @type {(() => unknown) | null} */
  #act = null;
  #cancel = h("button", { type: "button", class: "plain", text: "Cancel", on: { click: () => this.#act?.() } });
  #since_ms = performance.now();
  /** @type {ReturnType<typeof setInterval> | undefined} */
  #timer;

  /** @param {string} text */
  set what(text) {
    setText(this.#words, text);
  }

  /** @param {(() => unknown) | null} act */
  set cancel(act) {
    this.#act = act;
    this.#cancel.hidden = act === null;
  }

  connectedCallback() {
    this.setAttribute("role", "status");
    this.classList.add("waiting", "empty");
    fill(this, html`<span class="spinner" aria-hidden="true"></span>`, this.#words, this.#time, this.#cancel);
    this.#timer = setInterval(() => this.#tell(), 1000);
  }

  disconnectedCallback() {
    clearInterval(this.#timer);
  }

  #tell() {
    const waited_s = Math.floor((performance.now() - this.#since_ms) / 1000);
    const told =
      waited_s < TOLD_AFTER_S ? "" : waited_s < LONG_S ? `${waited_s} s` : `${waited_s} s: longer than usual`;
    setText(this.#time, told);
  }
}
customElements.define("waiting-note", WaitingNote);

/**
 * Say what is awaited.
 * @param {string} what a phrase, as "Loading the captures"
 * @param {(() => unknown) | null} [cancel] null: it cannot be cancelled
 */
export function waiting(what, cancel = null) {
  return html`<waiting-note .what=${what} .cancel=${cancel}></waiting-note>`;
}
