// The player of a recording: pictures, timeline, steps of one frame, speeds, keys.

import { fill, h, html, say } from "../dom.js";
import { count } from "../format.js";
import { icon } from "../icons.js";
import { PlayerClock, SPEEDS } from "./player_clock.js";
import { makePanes } from "./player_panes.js";
import { clockWords } from "./recording_words.js";

/**
 * @import { TimelineDocument } from "#api"
 * @typedef {{store: import("../store.js").Store, signal: AbortSignal, moved: (at_s: number) => void, depth: () => void}} PlayerContext
 */

const SCRUB_STEP_S = 0.01;
const SKIP_S = 1;

/**
 * @param {string} id
 * @param {TimelineDocument} timeline
 * @param {PlayerContext} context `moved`: called with the shown moment
 */
export function makePlayer(id, timeline, { store, signal, moved, depth }) {
  const panes = makePanes(id, timeline);
  let anaglyph = false;
  const clock = new PlayerClock(timeline, () => draw());
  const bar = makeControls(clock, {
    anaglyphs: panes.anaglyphs,
    turn: (on) => {
      anaglyph = on;
      draw();
    },
  });
  const draw = () => {
    bar.show();
    panes.show({ at_s: clock.at_s, playing: clock.playing, anaglyph });
    moved(clock.at_s);
  };
  run(clock, signal);
  const keys = keysOf(clock, { flip: () => bar.flip(), depth, letters: () => store.state.settings.single_keys });
  document.addEventListener("keydown", keys, { signal });
  draw();
  return { element: h("div", { class: "player" }, panes.element, bar.element), at: () => clock.at_s };
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

/** @param {PlayerClock} clock @param {{anaglyphs: boolean, turn: (on: boolean) => void}} options */
function makeControls(clock, { anaglyphs, turn }) {
  const tool = (
    /** @type {string} */ label,
    /** @type {import("../icons.js").IconName} */ name,
    /** @type {() => void} */ act,
  ) =>
    h("button", { class: "tool", type: "button", "aria-label": label, title: label, on: { click: act } }, icon(name));
  const play = tool("Play (K)", "play", () => clock.toggle());
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
  const speed = h(
    "select",
    { "aria-label": "Speed", on: { change: () => clock.setSpeed(Number(speed.value)) } },
    SPEEDS.map((each) => html`<option value=${each}>${each}×</option>`),
  );
  const switch_ = h("button", {
    type: "button",
    class: "plain",
    hidden: !anaglyphs,
    "aria-pressed": "false",
    title: "Anaglyph (A)",
    text: "Anaglyph",
  });
  const flip = () => {
    const on = anaglyphs && switch_.getAttribute("aria-pressed") !== "true";
    switch_.setAttribute("aria-pressed", String(on));
    turn(on);
  };
  switch_.addEventListener("click", flip);
  const element = h(
    "div",
    { class: "player-bar" },
    line,
    html`<div class="player-buttons">
      ${tool("One frame back (←)", "previous", () => clock.go(-1))}
      ${play}
      ${tool("One frame on (→)", "next", () => clock.go(1))}
      ${time}
      ${step}
      <span class="gap"></span>
      ${speed}
      ${switch_}
    </div>`,
  );
  let shown = /** @type {boolean | null} */ (null);
  return {
    element,
    flip,
    show: () => {
      if (shown !== clock.playing) {
        shown = clock.playing;
        fill(play, icon(shown ? "pause" : "play"));
        play.setAttribute("aria-label", shown ? "Pause (K)" : "Play (K)");
        play.title = shown ? "Pause (K)" : "Play (K)";
      }
      line.value = String(clock.at_s);
      line.setAttribute("aria-valuetext", clockWords(clock.at_s));
      speed.value = String(clock.speed);
      say(time, `${clockWords(clock.at_s)} / ${clockWords(clock.duration_s)}`);
      say(step, `frame ${count(clock.step + 1)} of ${count(clock.steps)}`);
    },
  };
}

/**
 * Return the action of each key. Space remains the stop.
 * @param {PlayerClock} clock
 * @param {{flip: () => void, depth: () => void, letters: () => boolean}} options
 */
function keysOf(clock, { flip, depth, letters }) {
  /** @type {Readonly<Record<string, () => void>>} */
  const acts = {
    ArrowLeft: () => clock.go(-1),
    ArrowRight: () => clock.go(1),
    Home: () => clock.seek(0),
    End: () => clock.seek(clock.duration_s),
  };
  /** @type {Readonly<Record<string, () => void>>} */
  const singles = {
    k: () => clock.toggle(),
    a: flip,
    d: depth,
    ",": () => clock.shiftSpeed(-1),
    ".": () => clock.shiftSpeed(1),
  };
  return (/** @type {KeyboardEvent} */ event) => {
    const { target, key } = event;
    if (event.ctrlKey || event.metaKey || event.altKey || document.querySelector("dialog[open]")) return;
    if (target instanceof Element && target.closest("input:not([type=range]), textarea, select")) return;
    const skip = event.shiftKey && (key === "ArrowLeft" || key === "ArrowRight");
    const act = skip
      ? () => clock.seek(clock.at_s + (key === "ArrowLeft" ? -SKIP_S : SKIP_S))
      : (acts[key] ?? (letters() ? singles[key.toLowerCase()] : undefined));
    if (!act) return;
    event.preventDefault();
    act();
  };
}
