// The element <drawn-picture src text>: a picture that the server draws, or the server's reason why it cannot.

import { file, outcome } from "../../transport/api.js";
import { h, setText } from "../../elements/dom.js";
import { sentence } from "../../elements/format.js";
import { API } from "../../root.js";

/** Attributes: `src`, `text` (its alternative), `lazy`, and the size that is reserved, `width` and `height` in px. */
class DrawnPicture extends HTMLElement {
  static observedAttributes = ["src", "text"];

  /** @type {HTMLImageElement | null} */
  #image = null;
  #reason = h("p", { class: "no-picture", hidden: true });

  connectedCallback() {
    if (this.#image) return;
    const [width, height] = [this.getAttribute("width"), this.getAttribute("height")];
    const loading = this.hasAttribute("lazy") ? "lazy" : "eager";
    this.#image = h("img", {
      ...{ loading, decoding: "async", width, height, draggable: "false" },
      on: { load: () => this.#settle(""), error: () => void this.#explain() },
    });
    this.classList.add("drawn");
    this.append(this.#image, this.#reason);
    this.#show();
  }

  /** @param {string} name */
  attributeChangedCallback(name) {
    if (name === "src") this.#show();
    else this.#image?.setAttribute("alt", this.getAttribute("text") ?? "");
  }

  #show() {
    const src = this.getAttribute("src");
    if (!this.#image || !src || this.#image.getAttribute("src") === src) return;
    this.#image.alt = this.getAttribute("text") ?? "";
    this.#image.hidden = false;
    this.#reason.hidden = true;
    this.setAttribute("aria-busy", "true");
    this.#image.src = src;
  }

  /** @param {string} why */
  #settle(why) {
    if (this.#image) this.#image.hidden = why !== "";
    this.#reason.hidden = why === "";
    setText(this.#reason, why);
    this.removeAttribute("aria-busy");
  }

  async #explain() {
    const failed = this.getAttribute("src") ?? "";
    const { error } = await outcome(file(failed.slice(API.length)));
    const why = error ? sentence(error.message) : "This picture could not be shown.";
    if (failed === this.getAttribute("src")) this.#settle(why);
  }
}

customElements.define("drawn-picture", DrawnPicture);
