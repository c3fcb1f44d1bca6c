// The timeline of a recording: a ruler, and a track a channel with its runs, gaps and drops. The wheel zooms at the
// pointer, a drag scrubs, with Shift, Alt or the middle button it pans; a track's name is dragged to another place.

import { fill, h, html, s, update } from "../../elements/dom.js";
import { clockWords } from "../gallery/recording_words.js";
import { following, panned, pulled, ticksOf, wholeOf, within, zoomed } from "./scale.js";
import { arrangementOf, keyOf, reordered, rowsOf, trackName, trackWords } from "./tracks.js";
import { toolButton } from "../../elements/parts.js";

/**
 * @import { PlayerLayout, TimelineDocument, TrackDocument, TracksDocument } from "#api"
 * @import { Span } from "./scale.js"
 * @import { Row } from "./tracks.js"
 * @typedef {{seek: (at_s: number) => void, changed: () => void}} TimelineActs `changed`: the arrangement is another
 */

const ZOOM = 1.25;
const WHEEL_PX = 100; // of the wheel for one step of zoom
const MOST_TICKS = 400; // frames that are drawn one by one

/** The timeline of one recording. */
export class Timeline {
  #duration_s;
  #acts;
  #times;
  /** @type {Row[]} */
  #rows;
  #focused = "";
  /** @type {Span} */
  #span;
  #at_s = 0;
  #ruler = h("div", { class: "ruler", "aria-hidden": "true" });
  #list = h("ol", { class: "tracks", "aria-label": "Tracks" });
  #head = h("div", { class: "playhead", "aria-hidden": "true" });
  #zone = h("div", { class: "track-zone", "aria-hidden": "true" });

  /**
   * @param {{tracks: TracksDocument, timeline: TimelineDocument}} recording
   * @param {TimelineActs} acts
   */
  constructor({ tracks, timeline }, acts) {
    this.#duration_s = timeline.duration_s;
    this.#acts = acts;
    this.#times = new Map(timeline.streams.map(({ name, t_s }) => [name, t_s]));
    this.#rows = rowsOf(tracks.tracks, []);
    this.#span = wholeOf(this.#duration_s);
    this.#zone.append(this.#head);
    this.element = h("div", { class: "replay-timeline" }, this.#ruler, this.#list, this.#zone);
    this.element.addEventListener("wheel", (event) => this.#wheel(event), { passive: false });
    this.element.addEventListener("pointerdown", (event) => this.#press(event));
    new ResizeObserver(() => this.#draw()).observe(this.element);
    this.#build();
  }

  /** @returns {Pick<PlayerLayout, "tracks" | "from_s" | "to_s">} */
  get arrangement() {
    return { tracks: arrangementOf(this.#rows), ...this.#span };
  }

  /** The focused camera's stream; empty when all are stepped through. */
  get focused() {
    const row = this.#rows.find(({ track }) => keyOf(track) === this.#focused);
    return row?.track.kind === "frames" ? row.track.name : "";
  }

  /** The tracks that are on. @returns {TrackDocument[]} */
  get shown() {
    return this.#rows.filter(({ on }) => on).map(({ track }) => track);
  }

  /** The tracks that are off. @returns {TrackDocument[]} */
  get hidden() {
    return this.#rows.filter(({ on }) => !on).map(({ track }) => track);
  }

  /** @param {PlayerLayout} layout */
  arrange({ tracks, from_s, to_s }) {
    this.#rows = rowsOf(
      this.#rows.map(({ track }) => track),
      tracks,
    );
    this.#span = within({ from_s, to_s }, this.#duration_s);
    this.#build();
  }

  /** @param {number} at_s @param {boolean} playing */
  show(at_s, playing) {
    this.#at_s = at_s;
    const span = playing ? following(this.#span, at_s, this.#duration_s) : this.#span;
    if (span !== this.#span) {
      this.#span = span;
      this.#draw();
    }
    this.#head.style.left = `${100 * this.#share(at_s)}%`;
    this.#head.hidden = at_s < this.#span.from_s || at_s > this.#span.to_s;
  }

  /** Show less or more, about the moment shown. @param {number} factor */
  zoom(factor) {
    const at_s = Math.min(Math.max(this.#at_s, this.#span.from_s), this.#span.to_s);
    this.#look(zoomed(this.#span, factor, at_s, this.#duration_s));
  }

  fit() {
    this.#look(wholeOf(this.#duration_s));
  }

  /** Switch the focused track on or off, or focus the first one. */
  toggleFocused() {
    const row = this.#rows.find(({ track }) => keyOf(track) === this.#focused);
    if (row) this.#turn(row);
    else this.#focus(this.#rows[0]);
  }

  /** @param {Span} span */
  #look(span) {
    this.#span = span;
    this.#draw();
    this.show(this.#at_s, false);
    this.#acts.changed();
  }

  /** @param {Row} row */
  #turn(row) {
    this.#rows = this.#rows.map((one) => (one === row ? { ...row, on: !row.on } : one));
    this.#build();
    this.#acts.changed();
  }

  /** @param {Row | undefined} row */
  #focus(row) {
    const key = row ? keyOf(row.track) : "";
    this.#focused = key === this.#focused ? "" : key;
    this.#build();
    this.#acts.changed();
  }

  /** @param {number} from @param {number} to */
  #move(from, to) {
    const rows = reordered(this.#rows, from, to);
    if (rows === this.#rows) return;
    this.#rows = rows;
    this.#build();
    this.#acts.changed();
  }

  /** Build the rows; their pictures are drawn by `#draw`. */
  #build() {
    update(
      this.#list,
      this.#rows.map((row, index) => this.#rowOf(row, index)),
    );
    this.#draw();
  }

  /** @param {Row} row @param {number} index */
  #rowOf(row, index) {
    const { track, on } = row;
    const [name, key] = [trackName(track), keyOf(track)];
    const title = trackWords(track);
    const keys = (/** @type {KeyboardEvent} */ event) => {
      const step = { ArrowUp: -1, ArrowDown: 1 }[event.key];
      if (step === undefined || !event.altKey) return;
      event.preventDefault();
      this.#move(index, index + step);
      this.#list.children[Math.min(Math.max(index + step, 0), this.#rows.length - 1)]?.querySelector("button")?.focus();
    };
    return html`<li class=${on ? "track" : "track off"} data-track=${key} data-role=${track.role ?? track.kind}>
      <span class="track-head">
        <button
          type="button" class="track-name" aria-pressed=${String(key === this.#focused)}
          title=${`${title}. Click: focus; drag, or Alt and ↑ ↓: move`} @click=${() => this.#focus(row)} @keydown=${keys}
        >
          ${name}
        </button>
        ${toolButton(`${on ? "Switch off" : "Switch on"} ${name}`, on ? "check" : "close", () => this.#turn(row), {
          title: `${on ? "Switch off" : "Switch on"} ${name} (V)`,
        })}
      </span>
      <svg class="track-line" preserveAspectRatio="none" role="img" aria-label=${title}></svg>
    </li>`;
  }

  #draw() {
    const { from_s, to_s } = this.#span;
    const width_px = this.#zone.clientWidth;
    for (const { track } of this.#rows) {
      const line = this.#list.querySelector(`[data-track="${CSS.escape(keyOf(track))}"] .track-line`);
      if (!line) continue;
      line.setAttribute("viewBox", `0 0 1000 20`);
      fill(line, ...this.#partsOf(track));
    }
    fill(
      this.#ruler,
      ...ticksOf({ from_s, to_s }, width_px).map(({ at_s, text }) =>
        h("span", { class: "tick number", text, style: `left: ${100 * this.#share(at_s)}%` }),
      ),
    );
  }

  /** Return what is drawn of a track: its runs, what is missing in them, and near by each frame. @param {TrackDocument} track */
  #partsOf({ name, runs, drops, period_s }) {
    const seen = (/** @type {number} */ from_s, /** @type {number} */ to_s) =>
      to_s >= this.#span.from_s && from_s <= this.#span.to_s;
    const x = (/** @type {number} */ at_s) => 1000 * Math.min(Math.max(this.#share(at_s), -0.01), 1.01);
    const bars = runs
      .filter(([from_s, to_s]) => seen(from_s, to_s + (period_s ?? 0)))
      .map(([from_s, to_s]) => {
        const left = x(from_s);
        const width = Math.max(x(to_s + (period_s ?? 0)) - left, 1.5);
        return s("rect", { class: "run", x: left, y: 3, width, height: 14 });
      });
    const lost = drops
      .filter(([from_s, to_s]) => seen(from_s, to_s))
      .map(([from_s, to_s, missing]) => {
        const left = x(from_s);
        const mark = s("rect", { class: "drop", x: left, y: 1, width: Math.max(x(to_s) - left, 2), height: 18 });
        mark.append(s("title", { text: `${missing} missing at ${clockWords(from_s)}` }));
        return mark;
      });
    return [...bars, ...lost, ...this.#framesOf(name, x)];
  }

  /** @param {string} name @param {(at_s: number) => number} x */
  #framesOf(name, x) {
    const { from_s, to_s } = this.#span;
    const all = this.#times.get(name) ?? [];
    const [first, last] = [all.findIndex((t_s) => t_s >= from_s), all.findLastIndex((t_s) => t_s <= to_s)];
    if (first < 0 || last < first || last - first > MOST_TICKS) return [];
    return all
      .slice(first, last + 1)
      .map((t_s) =>
        s("line", { class: "frame", x1: x(t_s), x2: x(t_s), y1: 3, y2: 17, "vector-effect": "non-scaling-stroke" }),
      );
  }

  /** @param {number} at_s */
  #share(at_s) {
    return (at_s - this.#span.from_s) / (this.#span.to_s - this.#span.from_s);
  }

  /** Return the moment under the pointer. @param {{clientX: number}} event */
  #under({ clientX }) {
    const { left, width } = this.#zone.getBoundingClientRect();
    return this.#span.from_s + ((clientX - left) / Math.max(width, 1)) * (this.#span.to_s - this.#span.from_s);
  }

  /** @param {WheelEvent} event */
  #wheel(event) {
    event.preventDefault();
    const sideways = event.shiftKey || Math.abs(event.deltaX) > Math.abs(event.deltaY);
    const turned = (sideways ? event.deltaX || event.deltaY : event.deltaY) * (event.deltaMode === 1 ? 33 : 1);
    const length_s = this.#span.to_s - this.#span.from_s;
    if (sideways)
      this.#look(panned(this.#span, (turned / Math.max(this.#zone.clientWidth, 1)) * length_s, this.#duration_s));
    else this.#look(zoomed(this.#span, ZOOM ** (-turned / WHEEL_PX), this.#under(event), this.#duration_s));
  }

  /** @param {PointerEvent} event */
  #press(event) {
    const target = /** @type {Element} */ (event.target);
    const name = target.closest(".track-name");
    if (name instanceof HTMLElement) return this.#drag(event, name);
    if (target.closest("button")) return undefined;
    if (event.button === 1 || event.shiftKey || event.altKey) return this.#pan(event);
    return event.button === 0 ? this.#scrub(event) : undefined;
  }

  /** @param {PointerEvent} event */
  #scrub(event) {
    const seek = (/** @type {PointerEvent} */ moved) => this.#acts.seek(this.#under(moved));
    seek(event);
    this.#follow(event, seek);
  }

  /** @param {PointerEvent} event */
  #pan(event) {
    event.preventDefault();
    const before = this.#span;
    const s_per_px = (before.to_s - before.from_s) / Math.max(this.#zone.clientWidth, 1);
    this.#follow(
      event,
      (moved) => {
        this.#span = pulled(before, (event.clientX - moved.clientX) * s_per_px, this.#duration_s);
        this.#draw();
        this.show(this.#at_s, false);
      },
      () => this.#look(within(this.#span, this.#duration_s)),
    );
  }

  /** Move a track to where its name is dropped. @param {PointerEvent} event @param {HTMLElement} name */
  #drag(event, name) {
    const rows = [...this.#list.children];
    const from = rows.findIndex((row) => row.contains(name));
    const placeOf = (/** @type {PointerEvent} */ { clientY }) =>
      rows.filter((row) => {
        const { top, height } = row.getBoundingClientRect();
        return clientY > top + height / 2;
      }).length;
    let to = from;
    this.#follow(
      event,
      (moved) => {
        if (Math.abs(moved.clientY - event.clientY) < 6) return;
        const place = placeOf(moved);
        to = place > from ? place - 1 : place;
        for (const [index, row] of rows.entries()) row.classList.toggle("target", index === to && to !== from);
      },
      () => {
        for (const row of rows) row.classList.remove("target");
        this.#move(from, to);
      },
    );
    return undefined;
  }

  /**
   * Follow the pointer until it is released.
   * @param {PointerEvent} event
   * @param {(moved: PointerEvent) => void} move
   * @param {() => void} [end]
   */
  #follow(event, move, end = () => {}) {
    const over = new AbortController();
    const of = (/** @type {(moved: PointerEvent) => void} */ act) => (/** @type {PointerEvent} */ moved) => {
      if (moved.pointerId === event.pointerId) act(moved);
    };
    const stop = of(() => {
      over.abort();
      end();
    });
    addEventListener("pointermove", of(move), { signal: over.signal });
    addEventListener("pointerup", stop, { signal: over.signal });
    addEventListener("pointercancel", stop, { signal: over.signal });
  }
}
