// The 3D pane: viser in a frame. Without WebGL a notice offers the files and the depth picture instead.

import { fill, h, html } from "../elements/dom.js";
import { icon } from "../elements/icons.js";
import { ROOT } from "../root.js";
import { textButton } from "../elements/parts.js";

/**
 * @import { TargetDocument } from "#api"
 * @import { ConsoleState, Store } from "#console"
 * @import { Keyboard } from "../keys.js"
 */

const CLOSEST_M = 0.2;
// share of the distance: a fovea's field is 1/20 of it wide, and fills half of the pane from here
const PART_OF_THE_WAY = 0.1;

/** The 3D pane of the console. */
export class Scene {
  #place;
  #store;
  #keyboard;
  #webgl = hasWebGL();
  /** @type {string | null} */
  #loaded_for = null;
  /** @type {HTMLIFrameElement | null} */
  #frame = null;
  #pointed = false;
  #tabbed = false;
  /** @type {Element | null} */
  #focused = null;
  #scroll_y = 0;

  /** @param {HTMLElement} place @param {{store: Store, keyboard: Keyboard}} context */
  constructor(place, { store, keyboard }) {
    this.#place = place;
    this.#store = store;
    this.#keyboard = keyboard;
    this.#keepFocus();
    store.on(["settings", "boot_id", "clouds"], (state) => void this.#update(state));
  }

  /** Point the 3D view at a target's cloud. @param {TargetDocument} target */
  select(target) {
    this.#store.set({ selected_target: target.id });
    if (!this.#frame || !target.point_rig_m) return;
    this.#frame.src = sceneUrl(this.#store.state, target.point_rig_m);
  }

  /** @param {ConsoleState} state */
  async #update(state) {
    if (!this.#webgl) return this.#offerFiles(state);
    if (!state.settings.scene) return this.#offer();
    if (!state.boot_id || this.#loaded_for === state.boot_id) return;
    this.#loaded_for = state.boot_id; // a new server has a new scene
    // the frame loads the page; this request only finds whether it is there
    const answer = await fetch(`${ROOT}/viser/?embedded=1`, { method: "HEAD" }).catch(() => null);
    if (answer?.ok) this.#load();
    else this.#failed();
  }

  /** Track which element has the focus, and whether the operator moves it into the frame. */
  #keepFocus() {
    document.addEventListener("keydown", ({ key }) => (this.#tabbed = key === "Tab"), { capture: true });
    document.addEventListener("focusin", ({ target }) => {
      if (target !== this.#frame) this.#focused = /** @type {Element} */ (target);
    });
    window.addEventListener("scroll", () => (this.#scroll_y = window.scrollY), { passive: true });
    window.addEventListener("blur", () => this.#keepScroll());
    this.#place.addEventListener("pointerenter", () => (this.#pointed = true));
    this.#place.addEventListener("pointerleave", () => (this.#pointed = false));
  }

  /** Stay where the page was scrolled to: an element of the frame that takes the focus scrolls to itself. */
  #keepScroll() {
    if (document.activeElement !== this.#frame || this.#pointed || this.#tabbed) return;
    const kept = this.#scroll_y; // the event of the scroll comes later
    requestAnimationFrame(() => window.scrollTo(0, kept));
  }

  /** Return the focus that the 3D page took when it loaded, unless the operator pointed or tabbed there. */
  #giveFocusBack() {
    if (this.#pointed || this.#tabbed) return;
    this.#keepScroll();
    this.#frame?.blur();
    window.focus();
    if (this.#focused instanceof HTMLElement && this.#focused.isConnected) this.#focused.focus();
  }

  #load() {
    const load = () => {
      const inside = this.#frame?.contentDocument;
      if (!inside) return;
      this.#keyboard.listenTo(inside);
      inside.addEventListener("focusin", () => this.#giveFocusBack());
    };
    this.#frame = h("iframe", {
      on: { load },
      title: "3D view of the rig and of what it measured",
      src: sceneUrl(this.#store.state, null),
      loading: "lazy",
    });
    const tools = h(
      "div",
      { class: "scene-tools" },
      textButton("Fit", () => this.#press("F"), { kind: "tool", title: "All that was found" }),
      textButton("From the rig", () => this.#press("R"), { kind: "tool", title: "As the wide camera sees it" }),
    );
    const grey = h("p", { class: "scene-note", text: "Grey: not measured" });
    this.#store.on(["targets"], ({ targets }) => (grey.hidden = !targets?.length));
    fill(this.#place, this.#frame, this.#cover(), tools, grey);
  }

  /**
   * Return what lies over the frame where a finger scrolls the page (the style sheet says where): a tap hands the frame
   * the fingers, a touch elsewhere or scrolling it away takes them back.
   */
  #cover() {
    const turn = (/** @type {boolean} */ turning) => this.#place.classList.toggle("turning", turning);
    document.addEventListener(
      "pointerdown",
      ({ target }) => this.#place.contains(/** @type {Node} */ (target)) || turn(false),
    );
    new IntersectionObserver(([seen]) => seen?.isIntersecting || turn(false)).observe(this.#place);
    return h("button", {
      type: "button",
      class: "scene-cover",
      on: { click: () => turn(true) },
      text: "Tap to turn and zoom",
    });
  }

  /** Press a key of the 3D page, with Alt: the page itself moves its camera. @param {"F" | "R"} key */
  #press(key) {
    const inside = this.#frame?.contentDocument;
    const what = { key: key.toLowerCase(), code: `Key${key}`, altKey: true, bubbles: true };
    inside?.documentElement.dispatchEvent(new KeyboardEvent("keydown", what));
  }

  #failed() {
    this.#frame = null;
    const again = textButton("Try again", () => {
      this.#loaded_for = null;
      void this.#update(this.#store.state);
    });
    fill(
      this.#place,
      html`<div class="notice">
        <strong>The 3D pane does not answer</strong>
        <p>Everything else works. The server's log says why it could not start.</p>
        ${again}
      </div>`,
    );
  }

  #offer() {
    this.#frame = null;
    this.#loaded_for = null;
    fill(
      this.#place,
      html`<div class="notice">${icon("cube")}<p>The 3D pane is switched off in the settings.</p></div>`,
    );
  }

  /** @param {ConsoleState} state */
  #offerFiles({ clouds }) {
    const newest = clouds[0];
    const picture = newest && h("img", { src: newest.depth_url, alt: "Colour-coded depth of the last fixation" });
    const files =
      newest &&
      h(
        "p",
        { class: "downloads" },
        html`<a href=${newest.ply_url} download="">${icon("down")}PLY</a>`,
        newest.glb_url && html`<a href=${newest.glb_url} download="">${icon("down")}GLB</a>`,
      );
    fill(
      this.#place,
      html`<div class="notice no-webgl">
        ${picture}
        <div>
          <strong>No 3D here: this browser has no WebGL</strong>
          <p>
            Views, fixations and distances work without it. Switch on hardware acceleration, or open the measured
            shape in another program.
          </p>
          ${files}
        </div>
      </div>`,
    );
  }
}

function hasWebGL() {
  const context = document.createElement("canvas").getContext("webgl2");
  context?.getExtension("WEBGL_lose_context")?.loseContext();
  return context !== null;
}

/**
 * Return the address of the 3D page, with the camera placed before a point if one is given.
 * @param {ConsoleState} state
 * @param {[number, number, number] | null} point_rig_m
 */
function sceneUrl({ settings }, point_rig_m) {
  const url = new URL(`${ROOT}/viser/`, location.href);
  const dark =
    settings.theme === "dark" || (settings.theme === "system" && matchMedia("(prefers-color-scheme: dark)").matches);
  url.searchParams.set("embedded", "1");
  if (dark) url.searchParams.set("darkMode", "");
  if (point_rig_m) {
    const reach = Math.hypot(...point_rig_m);
    const back = Math.max(CLOSEST_M, reach * PART_OF_THE_WAY) / reach;
    url.searchParams.set("initialCameraPosition", point_rig_m.map((at) => (at * (1 - back)).toFixed(4)).join(","));
    url.searchParams.set("initialCameraUp", "0,-1,0");
    url.searchParams.set("initialCameraLookAt", point_rig_m.map((at) => at.toFixed(4)).join(","));
  }
  return url.href;
}
