// Keeps the player's arrangement beside the recording: read when it is opened, written a moment after each change. One
// that cannot be read is reported, and nothing is written until the user confirms that it may be overwritten.

import { outcome, request } from "../../transport/api.js";
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
    const { answer } = await outcome(/** @type {Promise<LayoutDocument>} */ (request("GET", this.#path)));
    if (!answer) return null; // the player works without
    this.#usable = answer.state === "none" || answer.state === "kept";
    if (!this.#usable) this.#ask(answer.why);
    return answer.layout;
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
    const body = { layout: this.#layout(), replace };
    const { error } = await outcome(request("PUT", this.#path, { body, keepalive: true }));
    this.#usable = error === null;
    if (error) this.#ask(error.message);
    else update(this.element, null);
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
