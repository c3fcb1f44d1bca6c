// One followed target as a card: state, distance and figures, tracker and priority, letting go.

import { html } from "../../elements/dom.js";
import { nameField } from "../../panels/named_row.js";
import { badge, figures, textButton } from "../../elements/parts.js";
import { distanceOf, figuresOf, prioritiesWith, STATES, TRACKERS } from "./words.js";

/**
 * @import { FollowedDocument } from "#api"
 * @import { FollowOrders } from "./orders.js"
 */

/**
 * @param {FollowedDocument} followed
 * @param {{orders: FollowOrders, tools?: unknown, more?: unknown}} parts `tools`, `more`: what a page adds
 */
export function followCard(followed, { orders, tools, more }) {
  const { id, label, state, tracker, priority } = followed;
  const { tone, text, detail } = STATES[state];
  return html`<li class="follow-card" data-id=${id} data-state=${state}>
    <div class="head">
      ${nameField(label, { what: "followed target", rename: (name) => orders.change(id, { label: name }) })}
      ${badge(tone, text)}
      ${textButton("Let go", () => orders.letGo(id), { kind: "plain let-go", picture: "close" })}
    </div>
    <div class="reading"><p class="distance number">${distanceOf(followed)}</p>${tools}</div>
    <p class="lead" ?hidden=${detail === ""}>${detail}</p>
    ${figures(figuresOf(followed))}
    <div class="controls">
      ${choices("Tracker", tracker, TRACKERS, (chosen) => orders.change(id, { tracker: chosen }))}
      ${choices("Priority", priority, prioritiesWith(priority), (chosen) => orders.change(id, { priority: chosen }))}
    </div>
    ${more}
  </li>`;
}

/**
 * Build a select that shows the value again when the change was refused.
 * @template {string | number} T
 * @param {string} name
 * @param {T} now
 * @param {[T, string][]} known
 * @param {(value: T) => Promise<unknown>} change resolves with null when it was refused
 */
function choices(name, now, known, change) {
  const changed = async (/** @type {{target: HTMLSelectElement}} */ { target }) => {
    const value = known[target.selectedIndex]?.[0];
    if (value !== undefined && (await change(value)) === null) target.value = String(now);
  };
  return html`<label>
    ${name}
    <select @change=${changed}>
      ${known.map(([value, text]) => html`<option value=${value} .selected=${value === now}>${text}</option>`)}
    </select>
  </label>`;
}
