// Marks good targets on the wide view with one line of instructions, until the first click in this browser.

import { outcome, request } from "../transport/api.js";
import { fill, h, html, s, svg } from "../elements/dom.js";
import { icon } from "../elements/icons.js";
import { changeSettings } from "../settings.js";

/**
 * @import { SuggestionDocument } from "#api"
 * @import { Store } from "#console"
 * @import { Pane } from "./pane.js"
 */

const RADIUS_PX = 40; // of the wide picture
const LEAST_RADIUS_CSS_PX = 13;
const LETTERS_CSS_PX = 14;
const CHECK_MS = 20_000;

/** The hint over one wide pane; the setting `hints` switches it. */
export class Hints {
  #store;
  #pane;
  /** @type {SuggestionDocument[]} */
  #found = [];
  #asked = false;
  #marks = s("svg", { class: "overlay hints", "aria-hidden": "true" });
  #bar;

  /** @param {{store: Store, pane: Pane}} context */
  constructor({ store, pane }) {
    this.#store = store;
    this.#pane = pane;
    this.#bar = hintBar(
      html`<span>
        New here? <b>Click one of the marked things</b>: both foveae look at it, and its distance appears. Help (?) has a
        tour.
      </span>`,
      { label: "Hide the hint", title: "Hide; Help shows it again", act: () => this.dismiss() },
    );
    this.#bar.classList.add("first");
    pane.surface.append(this.#marks, this.#bar);
    store.on(["rig", "shown", "settings", "current", "targets", "hints_asked"], () => this.#follow());
  }

  /** Switch the hint off in this browser; the help dialog switches it on again. */
  dismiss() {
    this.#store.set({ hints_asked: false });
    changeSettings(this.#store, { hints: false });
  }

  /** Draw the marks at the picture's current position. */
  draw() {
    const { viewport } = this.#pane;
    const r = Math.max(LEAST_RADIUS_CSS_PX, RADIUS_PX * viewport.scale);
    // below lie the legend of the reach and the pane's edge
    const lowest = this.#pane.surface.clientHeight - 2.5 * LETTERS_CSS_PX;
    fill(
      this.#marks,
      ...this.#found.map(({ x_px, y_px }) => {
        const { x, y } = viewport.toCss({ x: x_px, y: y_px });
        const below = y + r + LETTERS_CSS_PX;
        return svg`<g class="try">
          <circle class="under" cx=${x} cy=${y} r=${r}></circle>
          <circle cx=${x} cy=${y} r=${r}></circle>
          <text x=${x} y=${below > lowest ? y - r - 5 : below} text-anchor="middle">try here</text>
        </g>`;
      }),
    );
  }

  #follow() {
    const { settings, current, rig, shown, targets, hints_asked } = this.#store.state;
    // the operator has clicked
    if (settings.hints && current?.mine && current.state !== "failed") return this.dismiss();
    const wanted = settings.hints && (hints_asked || targets?.length === 0);
    const ready = wanted && Boolean(rig?.calibration) && (shown.wide?.count ?? 0) > 0;
    if (!ready) {
      this.#asked = false;
      this.#show([]);
    } else if (!this.#asked) {
      this.#asked = true;
      void this.#read();
    }
  }

  async #read() {
    const { rig, hints_asked, lease_token } = this.#store.state;
    // A simulated rig looks at them first, a real one when it was asked to: its mirrors move by themselves for nobody.
    const checks = rig?.simulated || hints_asked;
    /** @type {Record<string, string>} */
    const headers = lease_token ? { "X-Lease": lease_token } : {};
    const found = checks ? await outcome(suggested("POST", "/suggestions/checks", { headers })) : null;
    const { answer } = found?.answer ? found : await outcome(suggested("GET", "/suggestions"));
    if (answer && this.#store.state.settings.hints) this.#show(answer); // without suggestions nothing is marked
  }

  /** @param {SuggestionDocument[]} found */
  #show(found) {
    if (found.length === 0 && this.#found.length === 0) return;
    this.#found = found;
    this.#bar.hidden = found.length === 0;
    this.draw();
  }
}

/**
 * @param {"GET" | "POST"} method
 * @param {string} path
 * @param {{headers?: Record<string, string>}} [options]
 */
function suggested(method, path, options = {}) {
  return /** @type {Promise<SuggestionDocument[]>} */ (request(method, path, { ...options, patience_ms: CHECK_MS }));
}

/**
 * Build a line over a picture, hidden at first, with a button that puts it away; a click on it is none on the picture.
 * @param {import("../elements/dom.js").Child} words
 * @param {{label: string, title: string, act: () => void}} away
 */
export function hintBar(words, { label, title, act }) {
  const bar = h("div", { class: "hint-bar", hidden: true, role: "note" });
  const button = html`<button type="button" class="tool" aria-label=${label} title=${title} @click=${act}>${icon("close")}</button>`;
  fill(bar, words, button);
  for (const type of ["pointerdown", "pointerup", "click", "dblclick"])
    bar.addEventListener(type, (event) => event.stopPropagation());
  return bar;
}
