// The player's pictures: wide with the outlines of both foveae, left, right, or an anaglyph of both. Each pane loads
// one picture at a time and then the newest that was requested, so that a slow line drops frames and does not fall
// behind.

import { RequestError, request } from "../api.js";
import { fill, h, html, s, say, svg } from "../dom.js";
import { angle, number } from "../format.js";
import { frameAt } from "./player_clock.js";
import { CAMERAS, recordingPath } from "./recording_words.js";

/**
 * @import { MomentDocument, TimelineDocument } from "#api"
 * @import { Role } from "#page"
 * @typedef {{at_s: number, playing: boolean, anaglyph: boolean}} Wanted
 */

const EYES = Object.freeze(/** @type {const} */ (["left", "right"]));

/** Loads the newest requested picture, one at a time. */
class Newest {
  #load;
  #shown = "";
  #next = "";
  #busy = false;

  /** @param {(what: string) => Promise<void>} load */
  constructor(load) {
    this.#load = load;
  }

  /** @param {string} what */
  async want(what) {
    this.#next = what;
    if (this.#busy) return;
    this.#busy = true;
    while (this.#shown !== this.#next) {
      this.#shown = this.#next;
      await this.#load(this.#shown);
    }
    this.#busy = false;
  }
}

/** @param {string} name @param {string} label @param {{width: number, height: number}} size */
function makePane(name, label, { width, height }) {
  const readout = h("span", { class: "number" });
  const reason = h("p", { class: "no-picture", hidden: true, text: "This frame could not be shown." });
  const surface = h(
    "div",
    { class: "player-surface" },
    html`<img alt="${label}: no frame yet" width=${width} height=${height} hidden />`,
    reason,
  );
  surface.style.aspectRatio = `${width} / ${height}`;
  const element = h(
    "figure",
    { class: `player-pane player-${name}`, data: { pane: name } },
    surface,
    html`<figcaption><b>${label}</b>${readout}</figcaption>`,
  );
  const load = async (/** @type {string} */ url) => {
    const image = new Image(width, height);
    image.alt = label;
    image.draggable = false;
    image.src = url;
    try {
      await image.decode();
      surface.querySelector("img")?.replaceWith(image);
      element.dataset["shown"] = url;
      reason.hidden = true;
    } catch {
      reason.hidden = false; // the next frame may be readable
    }
  };
  return { element, surface, readout, newest: new Newest(load) };
}

/** @param {string} id @param {TimelineDocument} timeline */
export function makePanes(id, timeline) {
  const streams = new Map(timeline.streams.map((stream) => [stream.role, stream]));
  const root = `/api/v1${recordingPath(id)}`;
  const panes = new Map(
    timeline.streams.map((stream) => [stream.role, makePane(stream.role, CAMERAS[stream.role], stream)]),
  );
  const both = EYES.every((role) => streams.has(role))
    ? makePane("anaglyph", "Anaglyph: left red, right cyan", streams.get("left") ?? { width: 4, height: 3 })
    : null;
  const prints = s("svg", { class: "player-prints", "aria-hidden": "true" });
  const wide = streams.get("wide");
  if (wide) {
    prints.setAttribute("viewBox", `-0.5 -0.5 ${wide.width} ${wide.height}`);
    panes.get("wide")?.surface.append(prints);
  }
  const told = new Newest(async (at_s) => {
    try {
      tell(await request("GET", recordingPath(id, `/frames?t_s=${at_s}`)));
    } catch (error) {
      if (!(error instanceof RequestError)) throw error;
    }
  });
  const tell = (/** @type {MomentDocument} */ moment) => {
    fill(
      prints,
      EYES.map((role) => printOf(role, moment)),
    );
    for (const [role, { readout }] of panes)
      say(readout, role === "wide" ? meetingWords(moment) : gazeWords(role, moment));
  };
  const element = h(
    "div",
    { class: "player-panes" },
    panes.get("wide")?.element,
    html`<div class="player-eyes">
      ${EYES.map((role) => panes.get(role)?.element ?? null)}
      ${both?.element ?? null}
    </div>`,
  );
  return {
    element,
    anaglyphs: both !== null,
    show: (/** @type {Wanted} */ { at_s, playing, anaglyph }) => {
      const indexes = [...panes].map(([role, pane]) => {
        const index = frameAt(/** @type {import("#api").TimelineStream} */ (streams.get(role)), at_s);
        const hidden = anaglyph && role !== "wide";
        pane.element.hidden = hidden;
        if (!hidden) void pane.newest.want(`${root}/frames/${role}/${index}.jpg${playing ? "?scale=2" : ""}`);
        return [role, index];
      });
      const left = streams.get("left");
      if (both) {
        both.element.hidden = !anaglyph;
        if (anaglyph && left)
          void both.newest.want(`${root}/anaglyph.jpg?t_s=${momentOf(left.t_s, frameAt(left, at_s))}`);
      }
      void told.want(momentOfAll(indexes, streams, at_s));
    },
  };
}

/** @param {readonly number[]} t_s @param {number} index */
function momentOf(t_s, index) {
  return (t_s[index] ?? 0).toFixed(6);
}

/**
 * Return the moment for which poses are requested: that of the foveae, which move.
 * @param {(Role | number)[][]} indexes
 * @param {Map<Role, import("#api").TimelineStream>} streams
 * @param {number} at_s
 */
function momentOfAll(indexes, streams, at_s) {
  const eye = indexes.find(([role]) => role === "left" || role === "right");
  const stream = eye && streams.get(/** @type {Role} */ (eye[0]));
  return stream ? momentOf(stream.t_s, Number(eye[1])) : at_s.toFixed(6);
}

/** @param {"left" | "right"} role @param {MomentDocument} moment */
function printOf(role, moment) {
  const corners = moment.frames[role]?.footprint_px;
  if (!corners) return null;
  return svg`<polygon
    class=${role} points=${corners.map((corner) => corner.join(",")).join(" ")} vector-effect="non-scaling-stroke"
  ></polygon>`;
}

/** @param {Role} role @param {MomentDocument} moment */
function gazeWords(role, { frames }) {
  const frame = frames[role];
  if (!frame) return "";
  if (frame.ax_deg !== null) return `${angle(frame.ax_deg)} across, ${angle(frame.ay_deg)} down`;
  return frame.x_v === null ? "pose not recorded" : `${number(frame.x_v, 1)} V, ${number(frame.y_v, 1)} V`;
}

/** @param {MomentDocument} moment */
function meetingWords({ meeting_m }) {
  return meeting_m === null ? "" : `eyes meet at ${number(meeting_m, 2)} m`;
}
