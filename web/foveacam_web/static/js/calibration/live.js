// The live pictures of the wizard: what the procedure draws while one runs, the plain views else. The panes of the
// console come here while the wizard is open and go back after; their clicks are asleep meanwhile.

import { h } from "../dom.js";
import { isRunning } from "./work.js";

/**
 * @typedef {import("../store.js").Store} Store
 * @typedef {import("../types.js").AnnotatedName} AnnotatedName
 * @typedef {import("../types.js").ConsoleState} ConsoleState
 * @typedef {import("../types.js").Role} Role
 * @typedef {import("../video/views.js").Views} Views
 * @typedef {import("./documents.js").WizardPage} WizardPage
 */

/** @type {Readonly<Partial<Record<WizardPage, Role[]>>>} */
const SHOWN = Object.freeze({ wide: ["wide"], mirrors: ["left", "right", "wide"], check: ["left", "right"], settle: ["left", "right"] });
/** @type {Role[]} */
const ROLES = ["wide", "left", "right"];
const RECENT_MS = 20_000; // a picture of the procedure that runs, not of the one before

/** The live pictures. */
export class Live {
  #views;
  #homes;
  /** @type {Map<Role, HTMLElement>} */
  #places = new Map();

  /**
   * @param {{store: Store, views: Views, homes: Record<Role, HTMLElement>}} context `homes`: where the panes are in the console
   */
  constructor({ store, views, homes }) {
    this.#views = views;
    this.#homes = homes;
    this.element = h("div", { class: "live" }, ROLES.map((role) => this.#place(role)));
    store.on(["wizard"], ({ wizard }) => this.#move(wizard));
    store.on(["wizard", "work", "server_stats", "views"], (state) => this.#choose(state));
  }

  /** @param {Role} role */
  #place(role) {
    const place = h("div", { class: `live-${role}` }, this.#views.pane(annotated(role)).element);
    this.#places.set(role, place);
    return place;
  }

  /** @param {WizardPage | null} wizard */
  #move(wizard) {
    const shown = (wizard && SHOWN[wizard]) || [];
    this.element.dataset["shows"] = shown.join(" ");
    for (const role of ROLES) {
      const pane = this.#views.pane(role);
      const place = wizard ? this.#places.get(role) : this.#homes[role];
      if (place && pane.element.parentElement !== place) place.prepend(pane.element);
      if (place && !wizard && role === "right") place.prepend(this.#views.pane("left").element); // left stands before right
      pane.surface.inert = wizard !== null;
      const own = this.#places.get(role);
      if (own) own.hidden = !shown.includes(role);
    }
    this.element.hidden = shown.length === 0;
  }

  /** @param {ConsoleState} state */
  #choose({ wizard, work, server_stats }) {
    for (const role of ROLES) {
      const age_ms = server_stats[annotated(role)]?.age_ms ?? null;
      const drawn = isRunning(work) && age_ms !== null && age_ms < RECENT_MS;
      this.#views.pane(annotated(role)).element.hidden = !drawn;
      this.#views.pane(role).element.hidden = drawn && wizard !== null;
    }
  }
}

/**
 * @param {Role} role
 * @returns {AnnotatedName}
 */
function annotated(role) {
  return `calibration_${role}`;
}
