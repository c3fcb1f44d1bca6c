// Shows the wizard's live pictures: the procedure's annotated views while one runs, else the plain ones.

import { h } from "../../elements/dom.js";
import { isRunning } from "./state.js";

/**
 * @import { AnnotatedName, ConsoleState, Role, Store, WizardPage } from "#console"
 * @import { Views } from "../../video/views.js"
 */

/** @type {Readonly<Partial<Record<WizardPage, Role[]>>>} */
const SHOWN = Object.freeze({
  wide: ["wide"],
  mirrors: ["left", "right", "wide"],
  check: ["left", "right"],
  settle: ["left", "right"],
});
/** @type {Role[]} */
const ROLES = ["wide", "left", "right"];
const RECENT_MS = 20_000; // longest time between two pictures of a slow procedure

/** The live pictures of the wizard. */
export class Live {
  #views;
  /** Where the console's panes are while the wizard is open. @type {Map<Role, HTMLElement>} */
  slots = new Map();
  #part = "";
  #done = 0;
  #since_ms = 0;

  /** @param {{store: Store, views: Views}} context */
  constructor({ store, views }) {
    this.#views = views;
    this.element = h(
      "div",
      { class: "live" },
      ROLES.map((role) => this.#place(role)),
    );
    store.on(["wizard", "work"], (state) => this.#show(shownRoles(state)));
    store.on(["wizard", "work", "server_stats", "views"], (state) => this.#choose(state));
  }

  /** @param {Role} role */
  #place(role) {
    const place = h("div", { class: `live-${role}` }, this.#views.pane(annotated(role)).element);
    this.slots.set(role, place);
    return place;
  }

  /** @param {Role[]} shown */
  #show(shown) {
    this.element.dataset["shows"] = shown.join(" ");
    for (const [role, slot] of this.slots) slot.hidden = !shown.includes(role);
    this.element.hidden = shown.length === 0;
  }

  /**
   * Return how long the current stage has run: pictures of an earlier stage show another pose.
   * @param {ConsoleState} state
   */
  #age_ms({ work }) {
    const part = `${work?.job_id} ${work?.stage}`;
    if (part !== this.#part || (work?.done ?? 0) < this.#done) this.#since_ms = performance.now();
    [this.#part, this.#done] = [part, work?.done ?? 0];
    return performance.now() - this.#since_ms;
  }

  /** @param {ConsoleState} state */
  #choose(state) {
    const { wizard, work, server_stats } = state;
    const limit_ms = Math.min(RECENT_MS, this.#age_ms(state));
    for (const role of ROLES) {
      const age_ms = server_stats[annotated(role)]?.age_ms ?? null;
      const drawn = isRunning(work) && age_ms !== null && age_ms < limit_ms;
      this.#views.pane(annotated(role)).element.hidden = !drawn;
      this.#views.pane(role).element.hidden = drawn && wizard !== null;
    }
  }
}

/** Return whose pictures belong to the open step, or to the fovea whose lens is looked for. @param {ConsoleState} state */
function shownRoles({ wizard, work }) {
  if (wizard === "wide" && work?.step === "lens" && isRunning(work))
    return ROLES.filter((role) => role !== "wide" && role === (work.options?.["camera"] ?? role));
  return (wizard && SHOWN[wizard]) || [];
}

/** @param {Role} role @returns {AnnotatedName} */
function annotated(role) {
  return `calibration_${role}`;
}
