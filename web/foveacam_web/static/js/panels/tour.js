// The first tour: a card that leads through five steps, each done by the person, and that can be left at any of them.

import { fill, h, html } from "../elements/dom.js";
import { textButton, toolButton } from "../elements/parts.js";
import { LAST, showsDataset, stepAfter, STEPS } from "./tour_steps.js";

/** @import { Store } from "#console" */

/** The tour of one page. */
export class Tour {
  #store;
  #element = h("aside", { class: "tour", role: "region", "aria-label": "First tour", hidden: true });
  #step = 0;
  /** Id of the newest event before the step that is shown. */
  #seen = 0;

  /** @param {Store} store */
  constructor(store) {
    this.#store = store;
    document.body.append(this.#element);
    store.on(["log", "gallery"], () => this.#follow());
  }

  get runs() {
    return !this.#element.hidden;
  }

  start() {
    this.#seen = this.#store.state.log.at(-1)?.id ?? 0;
    this.#element.hidden = false;
    this.#go(0);
  }

  leave() {
    this.#element.hidden = true;
  }

  #follow() {
    if (!this.runs) return;
    const { log, gallery } = this.#store.state;
    const events = log.filter(({ id }) => id > this.#seen);
    this.#seen = log.at(-1)?.id ?? this.#seen;
    const step = stepAfter(this.#step, events);
    if (step !== this.#step) this.#go(step);
    if (this.#step === LAST && showsDataset(gallery)) this.#go(STEPS.length);
  }

  /** @param {number} step */
  #go(step) {
    this.#step = step;
    const shown = STEPS[step];
    fill(
      this.#element,
      html`<header>
        <h2>${shown ? `${step + 1} of ${STEPS.length}: ${shown.title}` : "That was the tour"}</h2>
        ${toolButton("Leave the tour", "close", () => this.leave())}
      </header>`,
      shown ? this.#words(shown) : ended(() => this.leave()),
    );
  }

  /** @param {import("./tour_steps.js").Step} step */
  #words({ words, keys, to, at, place }) {
    return html`<p role="status">${words}</p>
      ${keys && html`<p class="lead">${keys}</p>`}
      <p class="actions">
        ${textButton(to, () => void lead(at, place), { kind: "plain primary" })}
        ${textButton("Skip", () => this.#go(this.#step + 1))}
      </p>`;
  }
}

/** @param {() => void} leave */
function ended(leave) {
  return html`<p role="status">
      A click, the whole field, a length, a capture and its pictures: the rest is under More, and Help (?) knows the keys.
    </p>
    <p class="actions">${textButton("Close", leave, { kind: "plain primary" })}</p>`;
}

/** Open a page and put the focus on a part of it, once it is there. @param {string} at @param {string} place */
async function lead(at, place) {
  location.hash = at;
  for (let tries = 0; tries < 40; tries += 1) {
    const found = document.querySelector(place);
    if (found instanceof HTMLElement && found.offsetParent) {
      found.scrollIntoView({ block: "center" });
      return found.focus({ preventScroll: true });
    }
    await new Promise((resolve) => setTimeout(resolve, 100));
  }
}
