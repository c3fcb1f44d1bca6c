// Holds all views of a page: their panes, the stream that feeds them, and the subscription with the size of each.

import { EyesStay } from "./eyes_stay.js";
import { openStream } from "./link.js";
import { ANNOTATED, Pane, VIEWS } from "./pane.js";
import { sufficientScale } from "./viewport.js";
import { WideView } from "./wide.js";

/**
 * @import { Commands, ConsoleState, PictureScale, Store, StreamReport, Subscription, ViewName } from "#console"
 * @import { FollowOrders } from "../looking/follow/orders.js"
 * @import { LoopOrders } from "../looking/loop/orders.js"
 * @import { Steering } from "../looking/steer/steering.js"
 */

/** @type {Set<ViewName>} */
const LATER = new Set(ANNOTATED);
/** @type {ViewName[]} */
export const DERIVED = ["anaglyph", "difference", "depth", "wide_depth", "wide_zoom"];

/** The views and their stream. */
export class Views {
  #store;
  #stream;
  #asked = "";
  /** @type {Map<ViewName, Pane>} */
  #panes = new Map();
  /** @type {ViewName} */
  #tab = "anaglyph";

  /** @param {{store: Store, commands: Commands, follows: FollowOrders, loop: LoopOrders, steering: Steering, onBoot: (boot_id: string) => void}} context */
  constructor({ store, commands, follows, loop, steering, onBoot }) {
    this.#store = store;
    this.#stream = openStream((report) => this.#onReport(report, onBoot));
    for (const name of /** @type {ViewName[]} */ (Object.keys(VIEWS))) {
      if (!LATER.has(name)) this.#addPane(name);
    }
    this.wide = new WideView(this.pane("wide"), { store, commands, follows, loop, steering, stream: this.#stream });
    for (const eye of /** @type {const} */ (["left", "right"])) {
      this.pane(eye).surface.addEventListener("click", (event) => this.#partEye(eye, event, loop));
    }
    document.addEventListener("visibilitychange", () => this.#subscribe());
    store.on(["settings"], () => this.#subscribe());
    store.on(["signed_out"], ({ signed_out }) => this.#stream.halt(signed_out));
    const stay = new EyesStay();
    store.on(["current", "overlay"], (state) => {
      const eyes_stay = stay.update(state);
      if (eyes_stay !== state.eyes_stay) store.set({ eyes_stay });
    });
    store.on(["shown", "stream", "rig", "server_stats", "settings", "current", "eyes_stay"], (state) => {
      for (const pane of this.#panes.values()) pane.update(state);
    });
  }

  /**
   * Return the pane of a view; panes that not every page has are created on first use.
   * @param {ViewName} name
   * @returns {Pane}
   */
  pane(name) {
    if (!this.#panes.has(name)) this.#addPane(name);
    return /** @type {Pane} */ (this.#panes.get(name)); // the constructor has created one of each
  }

  /**
   * On the page of the loop, let an eye keep the clicked place of its picture in the middle.
   * @param {"left" | "right"} eye
   * @param {MouseEvent} event
   * @param {LoopOrders} loop
   */
  #partEye(eye, event, loop) {
    const { surface, viewport } = this.pane(eye);
    const box = surface.getBoundingClientRect();
    const pixel = viewport.toSensor({ x: event.clientX - box.left, y: event.clientY - box.top });
    if (this.#store.state.loop_page && viewport.holds(pixel)) void loop.partEye(eye, pixel);
  }

  /** Shrink every enlarged pane; return whether there was one. */
  shrinkAll() {
    const large = [...this.#panes.values()].filter((pane) => pane.large);
    for (const pane of large) pane.setLarge(false);
    return large.length > 0;
  }

  /** The view of both eyes that is shown. */
  get derived() {
    return this.#tab;
  }

  /** Show one of the views derived from both eyes. @param {ViewName} chosen */
  showDerived(chosen) {
    this.#tab = chosen;
    for (const name of DERIVED) this.pane(name).element.hidden = name !== chosen;
    this.#subscribe();
  }

  /** @param {ViewName} name */
  #addPane(name) {
    const pane = new Pane(name);
    pane.resized = () => this.#subscribe();
    this.#panes.set(name, pane);
    this.#stream.addCanvas(name, pane.canvas);
  }

  /** @param {StreamReport} report @param {(boot_id: string) => void} onBoot */
  #onReport(report, onBoot) {
    const store = this.#store;
    if (report.type === "hello") {
      for (const info of report.hello.views) this.#panes.get(info.name)?.describe(info);
      const known = store.state.boot_id;
      store.set({ stream: "open", views: report.hello.views, boot_id: report.hello.server });
      this.#subscribe();
      if (known && known !== report.hello.server) onBoot(report.hello.server);
    } else if (report.type === "down") store.set({ stream: "down" });
    else if (report.type === "overlay") store.set({ overlay: report.overlay });
    else if (report.type === "stats") store.set({ server_stats: report.stats.views });
    else store.set({ shown: { ...unwatched(store.state.shown), ...report.views } });
  }

  /** Subscribe to the visible views, each at its size on the screen. */
  #subscribe() {
    /** @type {Subscription} */
    const views = {};
    if (!document.hidden) {
      for (const [name, pane] of this.#panes) {
        if (pane.visible && this.#served(name)) views[name] = { scale: this.#scale(pane) };
      }
    }
    const asked = JSON.stringify(views);
    if (asked === this.#asked) return;
    this.#asked = asked;
    this.#stream.subscribe(views);
  }

  /** Return whether a view can be subscribed: the server refuses views that it does not have. @param {ViewName} name */
  #served(name) {
    return !LATER.has(name) || this.#store.state.views.some((view) => view.name === name);
  }

  /** @param {Pane} pane @returns {PictureScale} */
  #scale(pane) {
    const { wide_size, fovea_size } = this.#store.state.settings;
    const wish = pane.name === "wide" ? wide_size : fovea_size;
    if (wish !== "auto") return wish === "full" ? 1 : 2;
    return sufficientScale(pane.device_width, pane.viewport.width);
  }
}

/** Return what was shown of views that are subscribed no more. @param {ConsoleState["shown"]} shown */
function unwatched(shown) {
  const entries = Object.entries(shown).map(([name, view]) => [name, { ...view, watched_ms: null }]);
  return /** @type {ConsoleState["shown"]} */ (Object.fromEntries(entries));
}
