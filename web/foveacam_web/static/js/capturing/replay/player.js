// The player of a recording: panes, timeline, steps of one frame, speeds, 3D modes, overlays, keys.

import { fill, h, html, setText, update } from "../../elements/dom.js";
import { count } from "../../elements/format.js";
import { clockWords } from "../gallery/recording_words.js";
import { icon } from "../../elements/icons.js";
import { textButton, toolButton } from "../../elements/parts.js";
import { STYLES } from "../../video/anaglyph_colours.js";
import { layoutOf, layoutText } from "../../operating/windows/layout.js";
import { openAside } from "../../operating/windows/opener.js";
import { Arrangement } from "./arrangement.js";
import { PlayerClock, SPEEDS } from "./clock.js";
import { leadWindows } from "./link.js";
import { NARROW_LAYOUT, ReplayPanes, isNarrow } from "./panes.js";
import { titleOf } from "./slot.js";
import { MODES, isShowable, stereoOf, withStereo } from "./stereo.js";
import { Timeline } from "./timeline.js";
import { ROOT } from "../../root.js";

/**
 * @import { PlayerLayout } from "#api"
 * @import { Layout, Source } from "#page"
 * @import { Now, Replayed } from "./panes.js"
 * @import { PressedKey } from "./link.js"
 * @typedef {{store: import("../../store.js").Store, signal: AbortSignal, moved: (at_s: number) => void, depth: () => void}} PlayerContext
 * @typedef {"boxes" | "footprints" | "depth"} OverlayName
 */

const SCRUB_STEP_S = 0.01;
const SKIP_S = 1;
const ZOOM = 1.6;
const REST_MS = 250;

/** @type {readonly [OverlayName, string, string][]} */
const OVERLAYS = Object.freeze([
  ["boxes", "Boxes", "Boxes of followed targets"],
  ["footprints", "Outlines", "Outlines of both foveae"],
  ["depth", "Depth", "Depth at which the gazes cross"],
]);

/** The player of one recording. */
export class Player {
  #id;
  #context;
  #clock;
  #timeline;
  #panes;
  #arrangement;
  #controls;
  #sendState = () => {};
  /** @type {Layout | null} */
  #kept = null;
  #quick = true;
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  #rest;
  /** The panes as they are arranged on a wider page. */
  #elsewhere = "";
  #style = /** @type {PlayerLayout["style"]} */ ("red_cyan");
  /** @type {Record<OverlayName, boolean>} */
  #overlays = { boxes: true, footprints: true, depth: true };

  /** @param {Replayed} recording @param {PlayerContext} context `moved`: called with the shown moment */
  constructor(recording, context) {
    const { signal } = context;
    this.#id = recording.id;
    this.#context = context;
    this.#clock = new PlayerClock(recording.timeline, () => this.#move());
    this.#arrangement = new Arrangement(recording.id, { layout: () => this.#layout, signal });
    this.#timeline = new Timeline(recording, {
      seek: (at_s) => this.#clock.seek(at_s),
      changed: () => this.#changed(),
    });
    const place = h("div", { class: "player-panes" });
    this.#panes = new ReplayPanes(place, recording, {
      keep: { read: () => this.#kept, write: () => this.#changed() },
      aside: (source) => this.#opener(source),
      signal,
    });
    this.#controls = this.#makeControls();
    this.element = h(
      "div",
      { class: "player" },
      this.#arrangement.element,
      place,
      this.#controls.element,
      this.#timeline.element,
    );
    this.#sendState = leadWindows(recording.id, {
      now: () => this.#now,
      press: (pressed) => this.#press(pressed),
      signal,
    });
    document.addEventListener("keydown", (event) => this.#down(event), { signal });
    run(this.#clock, signal);
    signal.addEventListener("abort", () => clearTimeout(this.#rest));
    this.#move();
  }

  /** The moment shown. */
  get at_s() {
    return this.#clock.at_s;
  }

  /** The part of the recording that the timeline shows. */
  get span() {
    const { from_s, to_s } = this.#timeline.arrangement;
    return { from_s, to_s };
  }

  /** Arrange the player as it was left. */
  async restore() {
    const layout = await this.#arrangement.read();
    if (!layout || this.#context.signal.aborted) return;
    const panes = layoutOf(layout.panes);
    this.#style = layout.style;
    this.#overlays = { boxes: layout.boxes, footprints: layout.footprints, depth: layout.depth };
    this.#timeline.arrange(layout);
    this.#clock.setSpeed(layout.speed);
    this.#kept = isShowable(panes) ? panes : null;
    if (this.#kept && isNarrow()) {
      this.#elsewhere = layout.panes;
      this.#kept = withStereo(NARROW_LAYOUT, layout.stereo);
    }
    this.#panes.board.read();
    this.#draw();
  }

  /** @returns {PlayerLayout} */
  get #layout() {
    const { layout } = this.#panes.board;
    return {
      ...this.#timeline.arrangement,
      ...this.#overlays,
      panes: this.#elsewhere || layoutText(layout),
      stereo: stereoOf(layout),
      style: this.#style,
      speed: this.#clock.speed,
    };
  }

  /** @returns {Now} */
  get #now() {
    const { shown } = this.#timeline;
    const off = this.#timeline.hidden.filter(({ kind }) => kind === "boxes").map(({ name }) => name);
    return {
      at_s: this.#clock.at_s,
      quick: this.#quick,
      style: this.#style,
      shown: shown.filter(({ kind }) => kind === "frames").map(({ name }) => name),
      overlays: { ...this.#overlays, off },
    };
  }

  /** Show another moment: quickly, and in full size when it rests. */
  #move() {
    this.#quick = true;
    clearTimeout(this.#rest);
    this.#rest = setTimeout(() => {
      this.#quick = this.#clock.playing;
      this.#draw();
    }, REST_MS);
    this.#draw();
  }

  #draw() {
    this.#controls.show();
    this.#timeline.show(this.#clock.at_s, this.#clock.playing);
    this.#panes.show(this.#now);
    this.#sendState();
    this.#context.moved(this.#clock.at_s);
  }

  /** Keep the arrangement, and show it. */
  #changed() {
    this.#clock.stepThrough(this.#timeline.focused);
    this.#arrangement.keep();
    this.#draw();
  }

  /** @param {PlayerLayout["stereo"]} mode */
  #turn(mode) {
    this.#panes.board.change(withStereo(this.#panes.board.layout, mode));
  }

  /** @param {Source} source */
  #opener(source) {
    return openAside(`${ROOT}/replay#${encodeURIComponent(this.#id)}:${source}`, titleOf(source));
  }

  #makeControls() {
    const clock = this.#clock;
    const play = toolIcon("Play (K)", "play", () => clock.toggle());
    const line = h("input", {
      type: "range",
      class: "timeline",
      "aria-label": "Moment",
      min: 0,
      max: clock.duration_s,
      step: SCRUB_STEP_S,
      on: { input: () => clock.seek(line.valueAsNumber) },
    });
    const time = h("span", { class: "number time" });
    const step = h("span", { class: "number step" });
    const options = h("div", { class: "player-options" });
    const element = h(
      "div",
      { class: "player-bar" },
      line,
      html`<div class="player-buttons">
        ${toolButton("One frame back (←)", "previous", () => clock.go(-1))}
        ${play}
        ${toolButton("One frame on (→)", "next", () => clock.go(1))}
        ${time}
        ${step}
        <span class="gap"></span>
        ${toolButton("Show more time (−)", "minus", () => this.#timeline.zoom(1 / ZOOM))}
        ${toolButton("Show less time (+)", "plus", () => this.#timeline.zoom(ZOOM))}
        ${toolButton("Show all of it (0)", "fit", () => this.#timeline.fit())}
      </div>`,
      options,
    );
    let shown = /** @type {boolean | null} */ (null);
    return {
      element,
      show: () => {
        if (shown !== clock.playing) {
          shown = clock.playing;
          fill(play, icon(shown ? "pause" : "play"));
          play.setAttribute("aria-label", shown ? "Pause (K)" : "Play (K)");
          play.title = shown ? "Pause (K)" : "Play (K)";
        }
        line.value = String(clock.at_s);
        line.setAttribute("aria-valuetext", clockWords(clock.at_s));
        setText(time, `${clockWords(clock.at_s)} / ${clockWords(clock.duration_s)}`);
        setText(step, `frame ${count(clock.step + 1)} of ${count(clock.steps)}`);
        update(options, this.#options());
      },
    };
  }

  /** Return the choices: speed, 3D, colours, overlays. */
  #options() {
    const stereo = stereoOf(this.#panes.board.layout);
    const set = (/** @type {Event} */ event) => this.#choose(event);
    const pick = (
      /** @type {string} */ label,
      /** @type {string} */ name,
      /** @type {readonly (readonly [string, string])[]} */ choices,
      /** @type {string} */ value,
    ) =>
      html`<label class="pick">${label}
        <select aria-label=${label} data-choice=${name} .value=${value} @change=${set}>
          ${choices.map(([one, text]) => html`<option value=${one} ?selected=${one === value}>${text}</option>`)}
        </select></label
      >`;
    return html`
      ${pick(
        "Speed",
        "speed",
        SPEEDS.map((each) => [String(each), `${each}×`]),
        String(this.#clock.speed),
      )}
      ${this.#panes.pairs && pick("3D", "stereo", MODES, stereo)}
      ${stereo === "anaglyph" && pick("Glasses", "style", STYLES, this.#style)}
      ${OVERLAYS.map(([name, text, title]) =>
        textButton(text, () => this.#flip(name), { title, pressed: this.#overlays[name] }),
      )}`;
  }

  /** @param {Event} event */
  #choose({ target }) {
    if (!(target instanceof HTMLSelectElement)) return;
    const { value } = target;
    if (target.dataset["choice"] === "stereo") return this.#turn(/** @type {PlayerLayout["stereo"]} */ (value));
    if (target.dataset["choice"] === "speed") this.#clock.setSpeed(Number(value));
    else this.#style = /** @type {PlayerLayout["style"]} */ (value);
    this.#changed();
  }

  /** @param {OverlayName} name */
  #flip(name) {
    this.#overlays = { ...this.#overlays, [name]: !this.#overlays[name] };
    this.#changed();
  }

  #flipAnaglyph() {
    if (!this.#panes.pairs) return;
    this.#turn(stereoOf(this.#panes.board.layout) === "anaglyph" ? "off" : "anaglyph");
  }

  /** Do what a key means; return whether it means something. Space remains the stop. @param {PressedKey} pressed */
  #press({ key, shift }) {
    const clock = this.#clock;
    /** @type {Readonly<Record<string, () => void>>} */
    const acts = {
      ArrowLeft: () => (shift ? clock.seek(clock.at_s - SKIP_S) : clock.go(-1)),
      ArrowRight: () => (shift ? clock.seek(clock.at_s + SKIP_S) : clock.go(1)),
      Home: () => clock.seek(0),
      End: () => clock.seek(clock.duration_s),
    };
    /** @type {Readonly<Record<string, () => void>>} */
    const singles = {
      k: () => clock.toggle(),
      a: () => this.#flipAnaglyph(),
      b: () => this.#flip("boxes"),
      d: () => this.#context.depth(),
      v: () => this.#timeline.toggleFocused(),
      "+": () => this.#timeline.zoom(ZOOM),
      "=": () => this.#timeline.zoom(ZOOM),
      "-": () => this.#timeline.zoom(1 / ZOOM),
      0: () => this.#timeline.fit(),
      ",": () => clock.shiftSpeed(-1),
      ".": () => clock.shiftSpeed(1),
    };
    const letters = this.#context.store.state.settings.single_keys;
    const act = acts[key] ?? (letters ? singles[key.toLowerCase()] : undefined);
    act?.();
    return act !== undefined;
  }

  /** @param {KeyboardEvent} event */
  #down(event) {
    const { target, key, shiftKey } = event;
    if (event.ctrlKey || event.metaKey || event.altKey || document.querySelector("dialog[open]")) return;
    if (target instanceof Element && target.closest("input:not([type=range]), textarea, select, .divider")) return;
    if (this.#press({ key, shift: shiftKey })) event.preventDefault();
  }
}

/** @param {string} label @param {import("../../elements/icons.js").IconName} name @param {() => void} act */
function toolIcon(label, name, act) {
  return h(
    "button",
    { class: "tool", type: "button", "aria-label": label, title: label, on: { click: act } },
    icon(name),
  );
}

/**
 * Advance the clock with each frame of the screen until the page closes.
 * @param {PlayerClock} clock
 * @param {AbortSignal} signal
 */
function run(clock, signal) {
  let before_ms = performance.now();
  const tick = (/** @type {number} */ now_ms) => {
    if (signal.aborted) return;
    // a tab that was in the background does not jump
    clock.pass(Math.min(0.25, Math.max(0, now_ms - before_ms) / 1000));
    before_ms = now_ms;
    requestAnimationFrame(tick);
  };
  requestAnimationFrame(tick);
}
