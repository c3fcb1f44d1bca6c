// One pane of a window: the live picture of a source, or the 3D view, with the controls of the pane.

import { h, html, say } from "../dom.js";
import { icon } from "../icons.js";
import { Scene } from "../panels/scene.js";
import { VIEWS, isLive } from "../video/pane.js";
import { SOURCES, isSource } from "./layout.js";
import { absenceWords, lossWords } from "./loss.js";

/**
 * @import { Axis, Box, ConsoleState, Source } from "#page"
 * @import { Keyboard } from "../keys.js"
 * @import { Store } from "../store.js"
 * @import { Views } from "../video/views.js"
 * @typedef {{
 *   split: (source: Source, axis: Axis) => void, close: (source: Source) => void,
 *   exchange: (source: Source, other: Source) => void
 * }} Acts what the controls do
 */

// of a pane, CSS px: its controls stay in reach
const LEAST_WIDTH = 150;
const LEAST_HEIGHT = 90;

/** @param {Source} source */
export function titleOf(source) {
  return source === "scene" ? "3D" : VIEWS[source].title;
}

/** The pane of one source. */
export class Slot {
  #acts;
  /** When the server went, while it is away. @type {number | null} */
  #gone_ms = null;

  /** @param {Source} source @param {{store: Store, views: Views, keyboard: Keyboard, acts: Acts}} context */
  constructor(source, { store, views, keyboard, acts }) {
    this.source = source;
    this.#acts = acts;
    this.age = h("p", { class: "picture-age number", hidden: true, role: "status" });
    this.select = this.#makeSelect();
    this.grip = h("span", { class: "grip", title: "Drag onto another pane to change places" }, icon("raster"));
    this.controls = h("span", { class: "controls" }, this.#buttons());
    this.element = h("div", { class: "slot", data: { source } }, this.#body({ store, views, keyboard }));
    this.#listenToGrip();
    store.on(["stream", "shown", "rig", "server_stats"], (state) => this.#update(state));
  }

  /** @param {Box} box */
  place({ left, top, width, height }) {
    const share = (/** @type {number} */ part) => `${100 * part}%`;
    Object.assign(this.element.style, {
      left: share(left),
      top: share(top),
      width: share(width),
      height: share(height),
    });
  }

  /** Enable what layout and room allow. @param {{several: boolean, full: boolean}} now `full`: every source is shown */
  allow({ several, full }) {
    const { clientWidth, clientHeight } = this.element;
    const refused = {
      row: full || clientWidth < 2 * LEAST_WIDTH,
      column: full || clientHeight < 2 * LEAST_HEIGHT,
      close: !several,
    };
    for (const button of this.controls.querySelectorAll("button"))
      button.disabled = refused[/** @type {keyof typeof refused} */ (button.dataset["act"])];
    this.select.value = this.source;
  }

  /** @param {{store: Store, views: Views, keyboard: Keyboard}} context */
  #body({ store, views, keyboard }) {
    if (this.source !== "scene") {
      const pane = views.pane(this.source);
      pane.header.prepend(this.grip, this.select);
      pane.tools.append(this.controls);
      pane.surface.append(this.age);
      return pane.element;
    }
    const place = h("div", { class: "scene" });
    new Scene(place, { store, keyboard });
    return h(
      "section",
      { class: "pane", "aria-label": "View 3D" },
      h("header", {}, this.grip, this.select, h("div", { class: "tools" }, this.controls)),
      h("div", { class: "surface" }, place, this.age),
    );
  }

  #makeSelect() {
    const change = () => {
      const other = this.select.value;
      if (isSource(other)) this.#acts.exchange(this.source, other);
    };
    return h(
      "select",
      { "aria-label": "Source of this pane", on: { change } },
      SOURCES.map(
        (source) => html`<option value=${source} ?selected=${source === this.source}>${titleOf(source)}</option>`,
      ),
    );
  }

  #buttons() {
    const button = (
      /** @type {string} */ label,
      /** @type {import("../icons.js").IconName} */ picture,
      /** @type {string} */ act,
      /** @type {() => void} */ click,
    ) =>
      h(
        "button",
        { type: "button", class: "tool", "aria-label": label, title: label, data: { act }, on: { click } },
        icon(picture),
      );
    const title = titleOf(this.source);
    return [
      button(`Split ${title}: new pane to the right`, "columns", "row", () => this.#acts.split(this.source, "row")),
      button(`Split ${title}: new pane below`, "rows", "column", () => this.#acts.split(this.source, "column")),
      button(`Close ${title}`, "close", "close", () => this.#acts.close(this.source)),
    ];
  }

  /** Exchange this pane with the one on which its grip is dropped. */
  #listenToGrip() {
    const under = (/** @type {PointerEvent} */ { clientX, clientY }) => {
      const found = document.elementFromPoint(clientX, clientY)?.closest(".slot");
      return found instanceof HTMLElement && found !== this.element ? found : null;
    };
    const mark = (/** @type {HTMLElement | null} */ target) => {
      for (const slot of document.querySelectorAll(".slot.target")) slot.classList.toggle("target", slot === target);
      target?.classList.add("target");
    };
    this.grip.addEventListener("pointerdown", (event) => {
      event.preventDefault();
      this.grip.setPointerCapture(event.pointerId);
    });
    this.grip.addEventListener("pointermove", (event) => {
      if (this.grip.hasPointerCapture(event.pointerId)) mark(under(event));
    });
    this.grip.addEventListener("pointerup", (event) => {
      const other = under(event)?.dataset["source"] ?? "";
      mark(null);
      if (isSource(other)) this.#acts.exchange(this.source, other);
    });
    this.grip.addEventListener("pointercancel", () => mark(null));
  }

  /** @param {ConsoleState} state */
  #update(state) {
    if (state.stream !== "down") this.#gone_ms = null;
    else this.#gone_ms ??= performance.now();
    const words =
      this.source === "scene"
        ? absenceWords(this.#gone_ms, performance.now())
        : lossWords(state, this.source, { needs: VIEWS[this.source].needs, live: isLive(this.source) });
    this.age.hidden = words === null;
    say(this.age, words ?? "");
  }
}
