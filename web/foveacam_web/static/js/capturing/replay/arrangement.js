// Keeps the player's arrangement beside the recording: read when it is opened, written a moment after each change. One
// that cannot be used is told, and nothing is written until somebody says that it may be overwritten.

import { RequestError, request } from "../../transport/api.js";
import { h, html, update } from "../../elements/dom.js";
import { recordingPath } from "../gallery/recording_words.js";
import { icon } from "../../elements/icons.js";
import { textButton } from "../../elements/parts.js";

/** @import { LayoutDocument, PlayerLayout } from "#api" */

const PAUSE_MS = 700;

/** The arrangement of one recording. */
export class Arrangement {
  #id;
  #layout;
  #usable = true;
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  #later;

  /**
   * @param {string} id
   * @param {{layout: () => PlayerLayout, signal: AbortSignal}} options `layout`: returns what is shown now
   */
  constructor(id, { layout, signal }) {
    this.#id = id;
    this.#layout = layout;
    this.element = h("div", { class: "arrangement" });
    signal.addEventListener("abort", () => {
      if (this.#later !== undefined) void this.#write(false);
    });
  }

  /** Read what is kept; null where nothing usable is. @returns {Promise<PlayerLayout | null>} */
  async read() {
    try {
      const found = /** @type {LayoutDocument} */ (await request("GET", this.#path));
      this.#usable = found.state === "none" || found.state === "kept";
      if (!this.#usable) this.#ask(found.why);
      return found.layout;
    } catch (error) {
      if (!(error instanceof RequestError)) throw error;
      return null; // the player works without
    }
  }

  /** Write what is shown now, in a moment. */
  keep() {
    if (!this.#usable) return;
    clearTimeout(this.#later);
    this.#later = setTimeout(() => void this.#write(false), PAUSE_MS);
  }

  get #path() {
    return recordingPath(this.#id, "/layout");
  }

  /** @param {boolean} replace */
  async #write(replace) {
    clearTimeout(this.#later);
    this.#later = undefined;
    try {
      await request("PUT", this.#path, { body: { layout: this.#layout(), replace }, keepalive: true });
      this.#usable = true;
      update(this.element, null);
    } catch (error) {
      if (!(error instanceof RequestError)) throw error;
      this.#usable = false;
      this.#ask(error.message);
    }
  }

  /** @param {string} why */
  #ask(why) {
    const overwrite = () => void this.#write(true);
    update(
      this.element,
      html`<p class="strip warn">
        ${icon("warn")}<span>The arrangement of the player is not kept: ${why}.</span>
        ${textButton("Overwrite it", overwrite)}
      </p>`,
    );
  }
}
