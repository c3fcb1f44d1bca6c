// One pane of the player: a camera's frame, or both foveae in one picture, or the reason why there is none.

import { fill, h, s, setText, svg } from "../../elements/dom.js";
import { angle, number } from "../../elements/format.js";
import { CAMERAS } from "../gallery/recording_words.js";
import { PaneControls, placeSlot } from "../../operating/windows/pane_controls.js";
import { Newest } from "./newest.js";
import { SOURCES } from "./stereo.js";

/**
 * @import { MomentDocument, RecordedBox } from "#api"
 * @import { Box, Role, Source } from "#page"
 * @import { Acts } from "../../operating/windows/pane_controls.js"
 * @typedef {{boxes: boolean, footprints: boolean, depth: boolean, off: readonly string[]}} Overlays
 *   what stands over the wide picture; `off`: the slots whose boxes are switched off
 */

const EYES = Object.freeze(/** @type {const} */ (["left", "right"]));

/** @param {Source} source */
export function titleOf(source) {
  if (source === "anaglyph") return "Anaglyph";
  if (source === "difference") return "Left − right";
  return CAMERAS[/** @type {Role} */ (source)] ?? source;
}

/** The pane of one source. */
export class ReplaySlot {
  #controls;
  #picture;
  #reason = h("p", { class: "no-picture", hidden: true, role: "status" });
  #readout = h("span", { class: "readout number" });
  #over = s("svg", { class: "player-prints", "aria-hidden": "true" });
  #newest;

  /**
   * @param {Source} source
   * @param {{acts: Acts, size: {width: number, height: number}, aside: (source: Source) => HTMLElement | null}} context
   *   `aside`: makes what opens the pane in a window of its own, if anything
   */
  constructor(source, { acts, size, aside }) {
    this.source = source;
    this.#controls = new PaneControls(source, { acts, titleOf, sources: SOURCES });
    this.select = this.#controls.select;
    const { width, height } = size;
    this.#picture = h("img", { alt: `${titleOf(source)}: no frame yet`, width, height, hidden: true });
    this.#over.setAttribute("viewBox", `-0.5 -0.5 ${width} ${height}`);
    const surface = h("div", { class: "surface player-surface" }, this.#picture, this.#over, this.#reason);
    const { grip, select, element } = this.#controls;
    this.pane = h(
      "section",
      { class: `pane player-pane player-${source}`, data: { pane: source }, "aria-label": titleOf(source) },
      h("header", {}, grip, select, this.#readout, h("div", { class: "tools" }, h("span", {}, aside(source)), element)),
      surface,
    );
    this.element = h("div", { class: "slot", data: { source } }, this.pane);
    this.#controls.listenToGrip(this.element);
    this.#newest = new Newest((url) => this.#load(url));
  }

  /** @param {Box} box */
  place(box) {
    placeSlot(this.element, box);
  }

  /** @param {{several: boolean, full: boolean}} now */
  allow(now) {
    this.#controls.allow(this.element, now);
  }

  /** Show a picture, or why there is none. @param {{url: string} | {reason: string}} what */
  show(what) {
    const reason = "reason" in what ? what.reason : "";
    this.#reason.hidden = reason === "";
    setText(this.#reason, reason);
    this.pane.classList.toggle("empty", reason !== "");
    if ("url" in what) void this.#newest.want(what.url);
  }

  /** @param {MomentDocument} moment @param {Overlays} overlays */
  showMoment(moment, overlays) {
    const { source } = this;
    if (source === "wide") {
      fill(this.#over, ...over(moment, overlays));
      setText(this.#readout, moment.meeting_m === null ? "" : `eyes meet at ${number(moment.meeting_m, 2)} m`);
    } else if (source === "left" || source === "right") setText(this.#readout, gazeWords(source, moment));
  }

  /** @param {string} url */
  async #load(url) {
    const image = new Image(this.#picture.width, this.#picture.height);
    image.alt = titleOf(this.source);
    image.draggable = false;
    image.src = url;
    try {
      await image.decode();
      this.#picture.replaceWith(image);
      this.#picture = image;
      this.pane.dataset["shown"] = url;
    } catch {
      this.show({ reason: "This frame could not be shown." }); // the next frame may be readable
    }
  }
}

/** @param {MomentDocument} moment @param {Overlays} overlays */
function over(moment, { boxes, footprints, depth, off }) {
  return [
    ...(footprints ? EYES.map((role) => printOf(role, moment)) : []),
    ...(boxes ? moment.boxes.filter(({ slot }) => !off.includes(slot)).map(boxOf) : []),
    depth && depthOf(moment),
  ];
}

/** @param {"left" | "right"} role @param {MomentDocument} moment */
function printOf(role, moment) {
  const corners = moment.frames[role]?.footprint_px;
  if (!corners) return null;
  return svg`<polygon
    class=${role} points=${corners.map((corner) => corner.join(",")).join(" ")} vector-effect="non-scaling-stroke"
  ></polygon>`;
}

/** @param {RecordedBox} box */
function boxOf({ slot, x_px, y_px, width_px, height_px }) {
  return svg`<g class="target-box">
    <rect x=${x_px} y=${y_px} width=${width_px} height=${height_px} vector-effect="non-scaling-stroke"></rect>
    <text x=${x_px} y=${y_px - 6}>${slot}</text>
  </g>`;
}

/** @param {MomentDocument} moment */
function depthOf({ meeting_px, meeting_z_m }) {
  if (!meeting_px || meeting_z_m === null) return null;
  const [x, y] = meeting_px;
  return svg`<g class="verged">
    <path d="M${x - 10} ${y}h20M${x} ${y - 10}v20" vector-effect="non-scaling-stroke"></path>
    <text x=${x + 16} y=${y - 12}>z ${number(meeting_z_m, 2)} m</text>
  </g>`;
}

/** @param {"left" | "right"} role @param {MomentDocument} moment */
function gazeWords(role, { frames }) {
  const frame = frames[role];
  if (!frame) return "";
  if (frame.ax_deg !== null) return `${angle(frame.ax_deg)} across, ${angle(frame.ay_deg)} down`;
  return frame.x_v === null ? "pose not recorded" : `${number(frame.x_v, 1)} V, ${number(frame.y_v, 1)} V`;
}
