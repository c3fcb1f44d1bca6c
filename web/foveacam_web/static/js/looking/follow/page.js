// Builds the page of followed targets: the wide view with their marks, both foveae, a card with the trail of each.

import { fill, h, html, update } from "../../elements/dom.js";
import { hand } from "../../elements/download.js";
import "../../elements/plot.js";
import { pageHead } from "../../pages.js";
import { allButtons, cards } from "./panel.js";
import { trailCsv, trailFile, trailRuns } from "./words.js";
import { textButton } from "../../elements/parts.js";

/**
 * @import { FollowedDocument, TrailPoint } from "#api"
 * @import { Role } from "#page"
 * @import { Slots } from "../../pages.js"
 * @import { PlotSpec } from "../../elements/plot.js"
 * @import { FollowContext } from "./panel.js"
 */

const LEAST_SPAN_S = 10;

/** @param {HTMLElement} place @param {FollowContext} context @returns {Slots} */
export function mountFollowPage(place, { store, orders }) {
  /** @type {Role[]} */
  const roles = ["wide", "left", "right"];
  const places = new Map(roles.map((role) => [role, h("div", { class: `lent lent-${role}` })]));
  const [all, list] = [h("span", { class: "all" }), h("div", { class: "follow-list" })];
  fill(
    place,
    pageHead("follow-title", "Followed targets", all),
    html`<div class="follow-body">
      <div class="column follow-see">
        ${places.get("wide") ?? null}
        <p class="lead">Click in the wide view, or drag a rectangle, to follow what is there.</p>
        <div class="capture-eyes">${places.get("left") ?? null}${places.get("right") ?? null}</div>
      </div>
      ${list}
    </div>`,
  );
  store.on(["followed", "trails", "follow_page"], (state) => {
    if (!state.follow_page) return;
    const added = (/** @type {FollowedDocument} */ { id, label }) => trailParts(label, state.trails[id] ?? []);
    update(all, allButtons(state, orders));
    update(list, cards(state, { orders, how: "click something that moves in the wide view", added }));
  });
  return places;
}

/** @param {string} label @param {TrailPoint[]} trail */
function trailParts(label, trail) {
  const save = () => hand(new Blob([trailCsv(trail)], { type: "text/csv" }), trailFile(label));
  return {
    tools: textButton("CSV", save, {
      picture: "down",
      title: `Save where it was as CSV, ${trail.length} hits`,
      disabled: trail.length === 0,
    }),
    more: trail.length > 0 ? trailPlot(trail) : html`<p class="empty">Its distance over time appears here.</p>`,
  };
}

/** @param {TrailPoint[]} trail */
function trailPlot(trail) {
  const runs = trailRuns(trail);
  /** @type {PlotSpec} */
  const spec = {
    words: `Distance over ${trail.length} hits`,
    height: 150,
    x: { name: "before the last hit, s", from: Math.min(-LEAST_SPAN_S, runs[0]?.[0]?.x ?? 0), to: 0 },
    y: { name: "distance, m" },
    curves: [{ name: "distance, m", colour: "--accent", runs }],
  };
  return html`<value-plot .spec=${spec}></value-plot>`;
}
