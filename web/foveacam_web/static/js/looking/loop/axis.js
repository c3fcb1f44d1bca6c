// One axis of the loop: a slider and a number that show its command and, moved by hand, set it; hold, and its error.

import { h, html, setText, update } from "../../elements/dom.js";
import { sentence } from "../../elements/format.js";
import { LatestOrder } from "../../transport/latest_order.js";
import { shareOf, valueAt, WAY } from "../../devices/rig/scale.js";
import { errorText, meetingText } from "./words.js";
import { textButton } from "../../elements/parts.js";

/**
 * @import { LoopAxisDocument } from "#api"
 * @import { LoopOrders } from "./orders.js"
 * @import { AXES } from "./words.js"
 */

const PAUSE_MS = 80;
const DECIMALS = 3;

/** The controls of one axis. */
export class AxisControl {
  #about;
  #orders;
  #entry;
  #slider;
  #hold = h("span", {});
  #error = h("output", { class: "axis-error number", title: "Error in the last look that showed it" });
  #meets = h("span", { class: "axis-meets number" });
  #refused = h("p", { class: "refused", role: "alert" });
  /** @type {LatestOrder<number>} */
  #sets;
  #span = { low: 0, high: 0 };
  #baseline_m = 0;
  #grabbed = false;
  #typing = false;

  /** @param {(typeof AXES)[number]} about @param {LoopOrders} orders */
  constructor(about, orders) {
    this.#about = about;
    this.#orders = orders;
    this.#sets = new LatestOrder({ pause_ms: PAUSE_MS, send: (value_deg) => this.#set(value_deg) });
    const { axis, name, title } = about;
    const id = `loop-${axis}`;
    this.#entry = h("input", {
      type: "number",
      id,
      step: "any",
      inputmode: "decimal",
      on: {
        input: () => (this.#typing = true),
        change: () => this.#typed(),
        blur: () => (this.#typing = false),
      },
    });
    this.#slider = h("input", {
      type: "range",
      min: 0,
      max: WAY,
      step: 1,
      "aria-label": `${name}, slider`,
      on: { input: () => this.#slide(), change: () => (this.#grabbed = false) },
    });
    this.element = h(
      "div",
      { class: "dial axis", role: "group", "aria-label": name, title, data: { axis } },
      html`<div class="line">
        <label class="axis-name" for=${id}>${name}</label>
        ${this.#meets}
        <span class="entry">${this.#entry}<span class="unit">°</span></span>
        ${this.#hold}
      </div>`,
      html`<div class="axis-track">${this.#slider}<span class="axis-off">error ${this.#error}</span></div>`,
      this.#refused,
    );
  }

  /**
   * @param {LoopAxisDocument} axis
   * @param {{open: boolean, baseline_m: number}} now `open`: whether it can be set
   */
  show({ command_deg, error_deg, least_deg, most_deg, held }, { open, baseline_m }) {
    this.#span = { low: least_deg, high: most_deg };
    this.#baseline_m = baseline_m;
    this.#entry.disabled = this.#slider.disabled = !open || most_deg <= least_deg;
    setText(this.#error, errorText(error_deg));
    update(this.#hold, this.#holdButton(held, open));
    if (this.#grabbed || this.#sets.busy) return;
    this.#place(command_deg);
    if (!this.#typing) this.#entry.value = command_deg.toFixed(DECIMALS);
  }

  /** @param {boolean} held @param {boolean} open */
  #holdButton(held, open) {
    const { axis, name } = this.#about;
    const act = async () => this.#showRefusal(await this.#orders.change({ held: { [axis]: !held } }));
    return textButton(held ? "Held" : "Hold", () => act(), {
      kind: "plain hold",
      name: `Hold ${name}`,
      title: held ? "Held: press to let the loop correct it again" : "Hold it: the loop does not correct it",
      disabled: !open,
      pressed: held,
    });
  }

  /** @param {number} value_deg */
  #place(value_deg) {
    this.#slider.value = String(Math.round(WAY * shareOf(this.#span, this.#about.kind, value_deg)));
    this.#slider.setAttribute("aria-valuetext", `${value_deg.toFixed(DECIMALS)}°`);
    if (this.#about.axis === "verge") setText(this.#meets, meetingText(value_deg, this.#baseline_m));
  }

  #slide() {
    this.#grabbed = true;
    const value_deg = valueAt(this.#span, this.#about.kind, Number(this.#slider.value) / WAY);
    this.#entry.value = value_deg.toFixed(DECIMALS);
    if (this.#about.axis === "verge") setText(this.#meets, meetingText(value_deg, this.#baseline_m));
    this.#sets.give(value_deg);
  }

  #typed() {
    const value_deg = this.#entry.valueAsNumber;
    this.#typing = false;
    if (Number.isFinite(value_deg)) this.#sets.give(value_deg);
  }

  /** @param {number} value_deg */
  async #set(value_deg) {
    const { low, high } = this.#span;
    const refusal =
      value_deg < low || value_deg > high
        ? `${value_deg}° is out of its range, ${low.toFixed(1)}° to ${high.toFixed(1)}°`
        : await this.#orders.change({ command_deg: { [this.#about.axis]: value_deg } });
    this.#showRefusal(refusal);
    return refusal === null ? true : null;
  }

  /** @param {string | null} refusal */
  #showRefusal(refusal) {
    setText(this.#refused, refusal ? sentence(refusal) : "");
  }
}
