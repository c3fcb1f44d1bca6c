// Operates the wide view: click, rectangle, steering, zoom, keyboard crosshair.

import { NEAR_CSS_PX, withCorrected } from "../looking/corrects.js";
import { h, html, setText } from "../elements/dom.js";
import { icon } from "../elements/icons.js";
import { directionOf, inField } from "./angles.js";
import { Gestures } from "./gestures.js";
import { Loupe } from "./loupe.js";
import { hintBar, Hints } from "./hints.js";
import { Overlay, ReachLegend } from "./overlay.js";
import { seeing } from "./reach.js";
import { MARKS_DEPEND_ON } from "./target_marks.js";

/**
 * @import { Commands, Point, Store } from "#console"
 * @import { FollowOrders } from "../looking/follow/orders.js"
 * @import { LoopOrders } from "../looking/loop/orders.js"
 * @import { Steering } from "../looking/steer/steering.js"
 * @import { StreamLink } from "./link.js"
 * @import { Pane } from "./pane.js"
 */

const ZOOM_STEP = 1.5;
const SMALLEST_SIDE_PX = 4; // a smaller rectangle is an accident

/** Gestures, overlay and loupe on the wide pane. */
export class WideView {
  #pane;
  #store;
  #commands;
  #follows;
  #loop;
  #steering;
  #overlay = new Overlay();
  #loupe;
  #legend = new ReachLegend();
  #hints;
  #gestures;
  #zoom_text = h("span", { class: "zoom number", text: "100 %" });
  /** @type {Point | null} */
  #pointer = null;
  /** @type {Point | null} */
  #cross = null;
  #hover_due = false;
  /** @type {Point | null} the last click, sensor px: read by tests */
  last_click = null;

  /** @param {Pane} pane @param {{store: Store, commands: Commands, follows: FollowOrders, loop: LoopOrders, steering: Steering, stream: StreamLink}} context */
  constructor(pane, { store, commands, follows, loop, steering, stream }) {
    this.#pane = pane;
    this.#store = store;
    this.#commands = commands;
    this.#follows = follows;
    this.#loop = loop;
    this.#steering = steering;
    this.#loupe = new Loupe(stream);
    pane.surface.append(this.#overlay.element, this.#legend.element, this.#loupe.element);
    this.#hints = new Hints({ store, pane });
    pane.tools.prepend(this.#followSwitch(), ...this.#tools());
    pane.placed = () => this.#redraw();
    this.#makeReachable();
    this.#gestures = new Gestures(pane.surface, this.#meanings());
    store.on(["overlay", "settings"], (state) => this.#overlay.drawFootprints(pane.viewport, state));
    store.on(["overlay", "followed", "follow_asked", "settings"], (state) =>
      this.#overlay.drawFollows(pane.viewport, state),
    );
    store.on(["rig", "intrinsics", "reach", "settings"], (state) => {
      this.#overlay.drawField(pane.viewport, state);
      this.#legend.show(state.settings.field ? state.reach : null);
      if (this.#pointer || this.#cross) this.#showAimed(); // what is beyond reach depends on the distance looked at
    });
    store.on(MARKS_DEPEND_ON, (state) => this.#overlay.drawMarks(pane.viewport, state));
  }

  /** The sensor pixel under the pointer or the crosshair, if any. */
  get aimed() {
    return this.#cross ?? (this.#pointer && this.#inside(this.#pointer));
  }

  abandon() {
    this.#gestures.abandon();
    this.#setCross(null);
  }

  /** @param {number} factor */
  zoom(factor) {
    const { clientWidth, clientHeight } = this.#pane.surface;
    this.#zoomAt(this.#pointer ?? { x: clientWidth / 2, y: clientHeight / 2 }, factor);
  }

  fit() {
    this.#pane.viewport.reset();
    this.#pane.place();
    this.#pane.resized();
  }

  /** Read the distance of the aimed pixel. */
  async probe() {
    const pixel = this.aimed;
    if (!pixel) return;
    this.#loupe.showDepth("measuring …");
    this.#loupe.showDepth(await this.#commands.depthAt(pixel));
  }

  #tools() {
    const tool = (
      /** @type {string} */ label,
      /** @type {import("../elements/icons.js").IconName} */ name,
      /** @type {() => void} */ act,
    ) =>
      h("button", { class: "tool", type: "button", "aria-label": label, title: label, on: { click: act } }, icon(name));
    return [
      tool("Zoom out (−)", "minus", () => this.zoom(1 / ZOOM_STEP)),
      this.#zoom_text,
      tool("Zoom in (+)", "plus", () => this.zoom(ZOOM_STEP)),
      tool("Fit (0)", "fit", () => this.fit()),
    ];
  }

  #followSwitch() {
    const button = h(
      "button",
      {
        class: "tool follow-switch",
        type: "button",
        title: "Follow what is clicked (T)",
        "aria-label": "Follow what is clicked",
        on: { click: () => this.#follows.toggle() },
      },
      icon("follow"),
      html`<span>Follow</span>`,
    );
    const bar = hintBar(
      html`<span><b>Following:</b> click what is to be followed, or drag a rectangle about it.</span>`,
      { label: "Stop following clicks", title: "Clicks look again (Escape)", act: () => this.#follows.end() },
    );
    this.#pane.surface.append(bar);
    this.#store.on(["click_follows"], ({ click_follows }) => {
      button.setAttribute("aria-pressed", String(click_follows));
      this.#pane.surface.classList.toggle("following", click_follows);
      bar.hidden = !click_follows;
    });
    return button;
  }

  #makeReachable() {
    const { surface } = this.#pane;
    surface.tabIndex = 0;
    surface.setAttribute("role", "application");
    surface.setAttribute(
      "aria-label",
      "Wide view. Arrow keys move a crosshair, Enter looks there or follows, Escape cancels.",
    );
    surface.addEventListener("keydown", (event) => this.#key(event));
    surface.addEventListener("blur", () => this.#setCross(null));
  }

  /** @returns {import("./gestures.js").Meanings} */
  #meanings() {
    return {
      click: (at) => this.#click(this.#pane.viewport.toSensor(at)),
      probe: (at) => {
        this.#pointer = at;
        void this.probe();
      },
      hover: (at) => this.#hover(at),
      rectangle: (from, to, done) => this.#rectangle(from, to, done),
      rectangleCancelled: () => this.#overlay.showRectangle(this.#pane.viewport, null),
      steer: (at, done) => this.#steer(at, done),
      pan: (dx, dy) => {
        this.#pane.viewport.pan(dx, dy);
        this.#pane.place();
      },
      zoom: (at, factor) => this.#zoomAt(at, factor),
      fit: () => this.fit(),
    };
  }

  /** @param {Point} pixel */
  #click(pixel) {
    if (!this.#pane.viewport.holds(pixel)) return; // the margin beside the picture
    this.last_click = pixel;
    this.#look({ pixel: { x_px: pixel.x, y_px: pixel.y } });
  }

  /** @param {Point} from @param {Point} to @param {boolean} done */
  #rectangle(from, to, done) {
    const { viewport } = this.#pane;
    const box = between(hold(viewport.toSensor(from), viewport), hold(viewport.toSensor(to), viewport));
    this.#overlay.showRectangle(viewport, done ? null : box);
    if (!done || box.width < SMALLEST_SIDE_PX || box.height < SMALLEST_SIDE_PX) return;
    this.#look({ rectangle: { x_px: box.x, y_px: box.y, width_px: box.width, height_px: box.height } });
  }

  /** Give what was chosen to the loop, follow or fixate it. @param {Pick<import("#api").FixationRequest, "pixel" | "rectangle">} request */
  #look(request) {
    const { state } = this.#store;
    if (state.loop_page) return void this.#loop.lookAt(request);
    if (state.click_follows || state.follow_page) return void this.#follows.follow(request);
    const named = state.overlay ? { ...request, frame_seq: state.overlay.seq } : request; // the picture that was clicked
    void this.#commands.fixate(withCorrected(named, state, NEAR_CSS_PX / this.#pane.viewport.scale));
  }

  /** @param {Point} at @param {boolean} done */
  #steer(at, done) {
    const { intrinsics, loop_page, loop } = this.#store.state;
    this.#pane.surface.classList.toggle("steering", !done);
    if (loop_page && loop?.running) {
      const pixel = hold(this.#pane.viewport.toSensor(at), this.#pane.viewport);
      return void (done ? this.#loop.release() : this.#loop.drag(pixel));
    }
    if (!intrinsics) {
      if (done) this.#commands.notifyNoCalibration();
      return;
    }
    this.#steering.look(directionOf(intrinsics, hold(this.#pane.viewport.toSensor(at), this.#pane.viewport)));
    if (done) this.#steering.release();
  }

  /** @param {Point | null} at */
  #hover(at) {
    this.#pointer = at;
    this.#loupe.showDepth(null);
    if (at) this.#setCross(null);
    if (this.#hover_due) return;
    this.#hover_due = true;
    requestAnimationFrame(() => {
      this.#hover_due = false;
      this.#showAimed();
    });
  }

  #showAimed() {
    const { viewport, surface } = this.#pane;
    const pixel = this.aimed;
    const { rig, intrinsics, reach } = this.#store.state;
    const beyond =
      pixel &&
      (reach
        ? seeing(reach, pixel) === "none"
        : rig?.steering && intrinsics && !inField(rig.steering, directionOf(intrinsics, pixel)));
    surface.classList.toggle("beyond", Boolean(beyond));
    const css = this.#cross ? viewport.toCss(this.#cross) : this.#pointer;
    this.#loupe.show(pixel, this.#store.state, {
      css: css ?? { x: 0, y: 0 },
      scale: viewport.scale,
      width: surface.clientWidth,
    });
  }

  /** @param {Point} at */
  #inside(at) {
    const pixel = this.#pane.viewport.toSensor(at);
    return this.#pane.viewport.holds(pixel) ? pixel : null;
  }

  /** @param {Point} at @param {number} factor */
  #zoomAt(at, factor) {
    this.#pane.viewport.zoomAt(at, factor);
    this.#pane.place();
    this.#pane.resized();
    this.#showAimed();
  }

  /** @param {KeyboardEvent} event */
  #key(event) {
    const { viewport } = this.#pane;
    const step = (event.shiftKey ? 10 : 1) / Math.max(1, viewport.scale);
    const moves = /** @type {Record<string, [number, number]>} */ ({
      ArrowLeft: [-step, 0],
      ArrowRight: [step, 0],
      ArrowUp: [0, -step],
      ArrowDown: [0, step],
    });
    const move = moves[event.key];
    if (event.key === "Enter" && this.#cross) this.#click(this.#cross);
    else if (!move) return;
    else {
      const at = this.aimed ?? { x: (viewport.width - 1) / 2, y: (viewport.height - 1) / 2 };
      this.#setCross(hold({ x: at.x + move[0], y: at.y + move[1] }, viewport));
    }
    event.preventDefault();
  }

  /** @param {Point | null} pixel */
  #setCross(pixel) {
    if (!pixel && !this.#cross) return;
    this.#cross = pixel;
    if (pixel) {
      this.#pane.viewport.reveal(pixel);
      this.#pane.place();
    }
    this.#overlay.showCross(this.#pane.viewport, pixel);
    this.#showAimed();
  }

  #redraw() {
    this.#overlay.draw(this.#pane.viewport, this.#store.state);
    this.#hints.draw();
    setText(this.#zoom_text, `${Math.round(this.#pane.viewport.zoom * 100)} %`);
  }
}

/** Return the nearest point of the picture. @param {Point} pixel @param {{width: number, height: number}} picture */
function hold({ x, y }, { width, height }) {
  return { x: Math.min(width - 1, Math.max(0, x)), y: Math.min(height - 1, Math.max(0, y)) };
}

/** @param {Point} a @param {Point} b */
function between(a, b) {
  return { x: Math.min(a.x, b.x), y: Math.min(a.y, b.y), width: Math.abs(a.x - b.x), height: Math.abs(a.y - b.y) };
}
