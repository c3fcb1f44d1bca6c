// The measuring tool: its kind, the views it is on, its bar; turns clicks and drags into measurements.

import { h, html, setText } from "../../elements/dom.js";
import { icon } from "../../elements/icons.js";
import { MeasureLayer } from "./layer.js";
import { KINDS } from "./words.js";
import { openPage, PAGE_KEYS } from "../../pages.js";
import { toolButton } from "../../elements/parts.js";

/**
 * @import { PlaceRequest } from "#api"
 * @import { MeasureKind, MeasuredView, Point, Store } from "#console"
 * @import { Views } from "../../video/views.js"
 * @import { MeasureOrders } from "./orders.js"
 */

/** @type {MeasuredView[]} */
const VIEWS = ["wide", "left", "right", "anaglyph", "difference", "depth"];
/** @type {Set<MeasuredView>} that show one look until the next: their pixels stay measurable by its fixation */
const WINDOWS = new Set(["anaglyph", "difference", "depth"]);
const ORDER = /** @type {MeasureKind[]} */ (Object.keys(KINDS));

/** The measuring tool of one page. */
export class MeasureTool {
  #store;
  #views;
  #orders;
  #look = "";
  /** @type {MeasureKind} */
  #last = "point";

  /** @param {{store: Store, views: Views, orders: MeasureOrders}} context */
  constructor({ store, views, orders }) {
    this.#store = store;
    this.#views = views;
    this.#orders = orders;
    for (const view of VIEWS) this.#equip(view);
    store.on(["clouds"], ({ clouds }) => this.#newLook(clouds[0]?.fixation_id ?? ""));
    store.on(["selected_measurement"], () => this.#forgetRefused());
    store.on(PAGE_KEYS, (state) => openPage(state) && this.end()); // who comes back, looks
    store.on(["click_follows"], ({ click_follows }) => click_follows && this.end()); // a click has one meaning
    views.pane("wide").surface.addEventListener("keydown", (event) => this.#key(event), { capture: true });
  }

  /** @param {MeasuredView} [view] */
  toggle(view = "wide") {
    const { measuring } = this.#store.state;
    if (measuring && measuring.view === view) this.end();
    else this.#set({ kind: measuring?.kind ?? this.#last, view, start: null, refused: [], busy: false });
  }

  /** End measuring; return whether the tool was on. */
  end() {
    if (!this.#store.state.measuring) return false;
    this.#orders.withdraw();
    this.#set(null);
    return true;
  }

  /** @param {number} number from 1: the kind to measure, while the tool is on */
  choose(number) {
    const { measuring } = this.#store.state;
    const kind = ORDER[number - 1];
    if (!measuring || !kind) return;
    this.#last = kind;
    this.#orders.withdraw();
    this.#set({ ...measuring, kind, start: null, refused: [] });
  }

  /** @param {import("#page").Measuring | null} measuring */
  #set(measuring) {
    document.body.classList.toggle("measuring", measuring !== null);
    this.#store.set(measuring ? { measuring, click_follows: false } : { measuring });
  }

  /** @param {MeasuredView} view */
  #equip(view) {
    const pane = this.#views.pane(view);
    const button = h(
      "button",
      {
        class: "tool measure-button",
        type: "button",
        "aria-pressed": "false",
        "aria-label": `Measure in the view ${pane.title.textContent}`,
        title: "Measure (M)",
        on: { click: () => this.toggle(view) },
      },
      icon("ruler"),
    );
    pane.tools.prepend(button);
    const layer = new MeasureLayer(pane, view, {
      kind: () => this.#store.state.measuring?.kind ?? null,
      start: () => startIn(this.#store.state.measuring, view),
      refused: () => (this.#store.state.measuring?.refused ?? []).filter((place) => place.view === view),
      click: (at) => this.#click(view, at),
      drag: (from, to) => this.#drag(view, from, to),
    });
    const bar = this.#bar();
    pane.element.append(bar.element);
    this.#store.on(["measuring"], ({ measuring }) => {
      button.setAttribute("aria-pressed", String(measuring?.view === view));
      bar.show(measuring?.view === view ? measuring : null);
    });
    this.#store.on(
      ["measurements", "hidden_measurements", "selected_measurement", "measuring", "clouds", "rig", "settings"],
      (state) => layer.draw(state),
    );
  }

  /** Build the tool's bar: the kinds, a hint, and the close button. */
  #bar() {
    const hint = h("span", { class: "hint", role: "status" });
    const kinds = ORDER.map((kind, index) =>
      h("button", {
        type: "button",
        text: KINDS[kind].title,
        title: `${KINDS[kind].title} (${index + 1}): ${KINDS[kind].hint}`,
        on: { click: () => this.choose(index + 1) },
      }),
    );
    const done = toolButton("Stop measuring", "close", () => this.end(), { title: "Stop measuring (Escape)" });
    const element = h(
      "div",
      { class: "measure-bar", role: "toolbar", "aria-label": "Measure", hidden: true },
      html`<span class="kinds">${kinds}</span>`,
      done,
      hint,
    );
    return {
      element,
      show: (/** @type {import("#page").Measuring | null} */ measuring) => {
        element.hidden = measuring === null;
        if (!measuring) return;
        ORDER.forEach((kind, index) => kinds[index]?.setAttribute("aria-pressed", String(kind === measuring.kind)));
        setText(
          hint,
          measuring.busy
            ? "Measuring …"
            : measuring.start
              ? "Click or tap the second point, in any view"
              : KINDS[measuring.kind].hint,
        );
      },
    };
  }

  /** @param {MeasuredView} view @param {Point} at */
  #click(view, at) {
    const { measuring } = this.#store.state;
    if (!measuring) return;
    const place = placeOf(view, at);
    if (measuring.kind === "point") void this.#measure("point", [place]);
    else if (measuring.kind !== "length") return;
    else if (measuring.start) void this.#measure("length", [measuring.start, place]);
    else this.#set({ ...measuring, start: place, refused: [] });
  }

  /** @param {MeasuredView} view @param {Point} from @param {Point} to */
  #drag(view, from, to) {
    const kind = this.#store.state.measuring?.kind;
    if (kind) void this.#measure(kind, [placeOf(view, from), placeOf(view, to)]);
  }

  /** @param {MeasureKind} kind @param {PlaceRequest[]} points */
  async #measure(kind, points) {
    const { measuring } = this.#store.state;
    if (!measuring || measuring.busy) return;
    this.#set({ ...measuring, start: null, refused: [], busy: true });
    const made = await this.#orders.measure(kind, points);
    const now = this.#store.state.measuring;
    if (now) this.#set({ ...now, refused: made ? [] : points, busy: false });
  }

  /** Show the places of a refused measurement no more: one was made. */
  #forgetRefused() {
    const { measuring } = this.#store.state;
    if (measuring?.refused.length) this.#set({ ...measuring, refused: [] });
  }

  /**
   * Keep the first point of a length when another look arrives, unless it lies in a raw fovea view, which has changed.
   * @param {string} look
   */
  #newLook(look) {
    const before = this.#look;
    this.#look = look;
    const { measuring } = this.#store.state;
    const start = measuring?.start;
    if (!measuring || !start || look === before || start.view === "wide" || start.fixation_id) return;
    const kept = WINDOWS.has(start.view) && before ? { ...start, fixation_id: before } : null;
    this.#set({ ...measuring, start: kept });
  }

  /** @param {KeyboardEvent} event */
  #key(event) {
    const at = this.#views.wide.aimed;
    if (event.key !== "Enter" || !this.#store.state.measuring || !at) return;
    event.preventDefault();
    event.stopPropagation();
    this.#click("wide", at);
  }
}

/** @param {import("#page").Measuring | null} measuring @param {MeasuredView} view */
function startIn(measuring, view) {
  const start = measuring?.start;
  return start && start.view === view && !start.fixation_id ? { x: start.x_px, y: start.y_px } : null;
}

/** @param {MeasuredView} view @param {Point} at @returns {PlaceRequest} */
function placeOf(view, { x, y }) {
  return { view, x_px: Math.round(x * 1000) / 1000, y_px: Math.round(y * 1000) / 1000 };
}
