// Lists what is followed, one card a target: the tab of the console, and the cards of the page.

import { FOLLOW_ADDRESS } from "../../addresses.js";
import { html, repeat, update } from "../../elements/dom.js";
import { followCard } from "./card.js";
import { textButton } from "../../elements/parts.js";
import { waiting } from "../../elements/waiting.js";

/**
 * @import { FollowedDocument } from "#api"
 * @import { ConsoleState, Store } from "#console"
 * @import { FollowOrders } from "./orders.js"
 * @typedef {{store: Store, orders: FollowOrders}} FollowContext
 */

/** @param {HTMLElement} place @param {FollowContext} context */
export function mountFollowed(place, { store, orders }) {
  store.on(["followed"], (state) =>
    update(
      place,
      html`<p class="follow-head">
          <a href=${FOLLOW_ADDRESS}>Page with trails</a>
          ${allButtons(state, orders)}
        </p>
        ${cards(state, { orders, how: "switch on Follow at the wide view (T), then click something that moves" })}`,
    ),
  );
}

/**
 * @param {ConsoleState} state
 * @param {{orders: FollowOrders, how: string, added?: (followed: FollowedDocument) => {tools: unknown, more: unknown}}} parts `how`: how to follow something here
 */
export function cards({ followed }, { orders, how, added }) {
  const empty = html`<p class="empty" ?hidden=${(followed ?? []).length > 0}>Nothing is followed: ${how}.</p>`;
  const card = (/** @type {FollowedDocument} */ each) => followCard(each, { orders, ...added?.(each) });
  return html`<ul class="follow-cards">${repeat(followed ?? [], ({ id }) => id, card)}</ul>
    ${followed === null ? waiting("Loading what is followed") : empty}`;
}

/** @param {ConsoleState} state @param {FollowOrders} orders */
export function allButtons({ followed }, orders) {
  const some = (followed ?? []).some(({ hits = 0 }) => hits > 0);
  return html`${textButton("Capture all", () => orders.captureAll(), {
    kind: "plain capture-all",
    picture: "raster",
    title: "One look at each target, kept as a dataset; they are followed on",
    hidden: !some,
  })}
    ${textButton("Let all go", () => orders.letAllGo(), {
      kind: "plain let-all-go",
      picture: "close",
      hidden: (followed ?? []).length < 2,
    })}`;
}
