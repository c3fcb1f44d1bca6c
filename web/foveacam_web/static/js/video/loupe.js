// The magnifier beside the pointer on the wide picture, with a readout of pixel, direction, reach and distance.

import { fill, h, html, setText } from "../elements/dom.js";
import { angle, distanceText, span } from "../elements/format.js";
import { directionOf, inField } from "./angles.js";
import { SEEING, seeing } from "./reach.js";

/**
 * @import { ConsoleState, Point } from "#page"
 * @import { StreamLink } from "./link.js"
 */

const SIDE_PX = 120;
const MAGNIFY = 6;

/** The loupe and its readout. */
export class Loupe {
  /** @param {StreamLink} stream */
  constructor(stream) {
    this.stream = stream;
    this.canvas = h("canvas", { width: SIDE_PX, height: SIDE_PX });
    this.pixel = h("span", { class: "number" });
    this.direction = h("span", { class: "number" });
    this.verdict = h("span", { class: "verdict" });
    this.depth = h("span", { class: "probe" });
    this.element = h(
      "div",
      { class: "loupe", hidden: true, "aria-live": "off" },
      html`<div class="glass">${this.canvas}</div>`,
      html`<div class="words">${this.pixel}${this.direction}${this.verdict}${this.depth}</div>`,
    );
    stream.setLoupeCanvas(this.canvas);
  }

  /**
   * Show the surroundings and the readout of a sensor pixel.
   * @param {Point | null} pixel null when the pointer is off the picture
   * @param {ConsoleState} state
   * @param {{css: Point, scale: number, width: number}} place of the pointer: the loupe is shown on the other side
   */
  show(pixel, state, place) {
    this.element.hidden = pixel === null;
    this.stream.aimLoupe(pixel, Math.max(MAGNIFY, place.scale * 2));
    if (!pixel) return;
    this.element.classList.toggle("to-left", place.css.x > place.width / 2);
    setText(this.pixel, `${pixel.x.toFixed(1)}, ${pixel.y.toFixed(1)} px`);
    const { text, verdict, beyond } = judge(pixel, state);
    setText(this.direction, text);
    setText(this.verdict, verdict);
    this.element.classList.toggle("beyond", beyond);
    this.element.classList.toggle("both", verdict === SEEING.both);
  }

  /** @param {import("#api").DepthDocument | string | null} found a sentence when there is no depth */
  showDepth(found) {
    if (found === null) fill(this.depth);
    else if (typeof found === "string") fill(this.depth, found);
    else
      fill(
        this.depth,
        html`<b>${distanceText(found.distance_m, found.distance_sigma_m)}</b>`,
        ` ${span(found.age_s)} ago`,
      );
  }
}

/** @param {Point} pixel @param {ConsoleState} state */
function judge(pixel, { intrinsics, reach, rig }) {
  if (!intrinsics) return { text: "", verdict: "", beyond: false };
  const direction = directionOf(intrinsics, pixel);
  const text = `${angle(direction.ax_deg)} ${angle(direction.ay_deg)}`;
  if (reach) {
    const who = seeing(reach, pixel);
    return { text, verdict: SEEING[who], beyond: who === "none" };
  }
  const beyond = Boolean(rig?.steering && !inField(rig.steering, direction));
  return { text, verdict: beyond ? SEEING.none : "", beyond };
}
