// Shows short messages in a corner: what happened, why, and what to do. Equal messages are counted, not stacked.

import { fill, h, html } from "./dom.js";
import { remedyOf, sentence } from "./format.js";
import { icon } from "./icons.js";

/**
 * @import { Problem } from "#api"
 * @typedef {{label: string, act: () => unknown}} Action
 * @typedef {{
 *   tone: "info" | "good" | "warn" | "bad", title: string, detail: string, remedy?: string | undefined,
 *   action?: Action | null, stay_ms?: number
 * }} Message
 */

const STAY_MS = 9000;
const MOST = 4;

/** The messages of one page. */
export class Toasts {
  /** @type {Map<string, {element: HTMLElement, times: number, counter: HTMLElement, timer: ReturnType<typeof setTimeout>}>} */
  #shown = new Map();

  constructor() {
    this.element = h("div", { class: "toasts", role: "region", "aria-label": "Messages" });
  }

  /** Show a problem; return what takes it away. @param {Problem} problem @param {Action | null} [action] */
  problem(problem, action = null) {
    const tone = problem.status >= 500 || problem.status === 0 ? "bad" : "warn";
    return this.show({
      tone,
      title: problem.title,
      detail: problem.detail,
      remedy: remedyOf(problem),
      action,
      stay_ms: 2 * STAY_MS,
    });
  }

  /** Show a message; return what takes it away. @param {Message} message @returns {() => void} */
  show(message) {
    const key = `${message.title}\n${message.detail}`;
    const stay_ms = message.stay_ms ?? STAY_MS;
    const same = this.#shown.get(key);
    if (same) {
      same.times += 1;
      fill(same.counter, `×${same.times}`);
      clearTimeout(same.timer);
      same.timer = setTimeout(() => this.#close(key), stay_ms);
      return () => this.#close(key);
    }
    this.#add(key, message, stay_ms);
    const oldest = this.#shown.keys().next().value;
    if (this.#shown.size > MOST && oldest !== undefined) this.#close(oldest);
    return () => this.#close(key);
  }

  /** @param {string} key @param {Message} message @param {number} stay_ms */
  #add(key, { tone, title, detail, remedy, action }, stay_ms) {
    const counter = h("span", { class: "times" });
    const element = h(
      "div",
      { class: `toast ${tone}`, role: tone === "bad" || tone === "warn" ? "alert" : "status" },
      icon(tone === "info" ? "info" : tone === "good" ? "check" : "warn"),
      html`<div class="body">
        <strong>${title} ${counter}</strong>
        ${detail && html`<p>${sentence(detail)}</p>`}
        ${remedy && html`<p class="remedy">${sentence(remedy)}</p>`}
        ${
          action &&
          html`<button type="button" class="plain" @click=${() => this.#act(key, action)}>
            ${action.label}
          </button>`
        }
      </div>`,
      html`<button type="button" class="tool" aria-label="Dismiss" @click=${() => this.#close(key)}>
        ${icon("close")}
      </button>`,
    );
    const timer = setTimeout(() => this.#close(key), stay_ms);
    this.#shown.set(key, { element, times: 1, counter, timer });
    this.element.append(element);
  }

  /** @param {string} key @param {Action} action */
  #act(key, action) {
    this.#close(key);
    action.act();
  }

  /** @param {string} key */
  #close(key) {
    const toast = this.#shown.get(key);
    if (!toast) return;
    clearTimeout(toast.timer);
    toast.element.remove();
    this.#shown.delete(key);
  }
}
