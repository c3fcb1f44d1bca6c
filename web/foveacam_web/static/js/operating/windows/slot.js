// One pane of a window: the live picture of a source, or the 3D view, with the controls of the pane.

import { h, setText } from "../../elements/dom.js";
import { Scene } from "../../panels/scene.js";
import { VIEWS, isLive } from "../../video/pane.js";
import { SOURCES } from "./layout.js";
import { absenceWords, lossWords } from "./loss.js";
import { PaneControls, placeSlot } from "./pane_controls.js";

/**
 * @import { Box, ConsoleState, Source, Store } from "#console"
 * @import { Keyboard } from "../../keys.js"
 * @import { Acts } from "./pane_controls.js"
 * @import { Views } from "../../video/views.js"
 */

/** @param {Source} source */
export function titleOf(source) {
  return source === "scene" ? "3D" : VIEWS[source].title;
}

/** The pane of one source. */
export class Slot {
  #controls;
  /** When the server went, while it is away. @type {number | null} */
  #gone_ms = null;

  /** @param {Source} source @param {{store: Store, views: Views, keyboard: Keyboard, acts: Acts}} context */
  constructor(source, { store, views, keyboard, acts }) {
    this.source = source;
    this.age = h("p", { class: "picture-age number", hidden: true, role: "status" });
    this.#controls = new PaneControls(source, { acts, titleOf, sources: SOURCES });
    this.select = this.#controls.select;
    this.element = h("div", { class: "slot", data: { source } }, this.#body({ store, views, keyboard }));
    this.#controls.listenToGrip(this.element);
    store.on(["stream", "shown", "rig", "server_stats"], (state) => this.#update(state));
  }

  /** @param {Box} box */
  place(box) {
    placeSlot(this.element, box);
  }

  /** Enable what layout and room allow. @param {{several: boolean, full: boolean}} now `full`: every source is shown */
  allow(now) {
    this.#controls.allow(this.element, now);
  }

  /** @param {{store: Store, views: Views, keyboard: Keyboard}} context */
  #body({ store, views, keyboard }) {
    const { grip, select, element } = this.#controls;
    if (this.source !== "scene") {
      const pane = views.pane(this.source);
      pane.header.prepend(grip, select);
      pane.tools.append(element);
      pane.surface.append(this.age);
      return pane.element;
    }
    const place = h("div", { class: "scene" });
    new Scene(place, { store, keyboard });
    return h(
      "section",
      { class: "pane", "aria-label": "View 3D" },
      h("header", {}, grip, select, h("div", { class: "tools" }, element)),
      h("div", { class: "surface" }, place, this.age),
    );
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
    setText(this.age, words ?? "");
  }
}
