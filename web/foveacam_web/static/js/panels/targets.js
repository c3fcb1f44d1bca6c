// Lists the targets: name, distance, fixate again, follow, show in 3D, delete.

import { answerText, basisMeaning, basisShort, boundText } from "../looking/answers.js";
import { html, repeat, update } from "../elements/dom.js";
import { angle } from "../elements/format.js";
import { toolButton } from "../elements/parts.js";
import { namedRow } from "./named_row.js";
import { waiting } from "../elements/waiting.js";

/**
 * @import { TargetDocument } from "#api"
 * @import { Commands, Store } from "#console"
 * @import { FollowOrders } from "../looking/follow/orders.js"
 * @typedef {{store: Store, commands: Commands, follows: FollowOrders, select: (target: TargetDocument) => void}} Context
 */

/** @param {HTMLElement} place @param {Context} context */
export function mountTargets(place, context) {
  context.store.on(["targets", "hidden_targets", "selected_target"], ({ targets, hidden_targets, selected_target }) => {
    const shown = (targets ?? []).filter(({ id }) => !hidden_targets.includes(id));
    const row = (/** @type {TargetDocument} */ target) => targetRow(target, target.id === selected_target, context);
    const empty = html`<p class="empty" ?hidden=${shown.length > 0}>Everything that you fixate is listed here.</p>`;
    update(
      place,
      html`<ul class="targets">${repeat(shown, ({ id }) => id, row)}</ul>
        ${targets === null ? waiting("Loading the targets") : empty}`,
    );
  });
}

/** @param {TargetDocument} target @param {boolean} selected @param {Context} context */
function targetRow(target, selected, { commands, follows, select }) {
  const { id, basis, bound } = target;
  const corrected = Boolean(target.corrections?.length);
  const title = `${angle(target.ax_deg)} ${angle(target.ay_deg)}${bound ? `, ${boundText(bound)}` : ""}`;
  const words = [basisShort(basis, target), corrected ? "corrected" : ""].filter(Boolean).join(", ");
  return namedRow(target, {
    what: "target",
    selected,
    basis,
    values: html`<span class="known">
      <span class="distance number" title=${title}>${answerText(target)}</span>
      <span class="basis" title=${basisMeaning(basis)} ?hidden=${basis === "both_foveae" && !corrected}>${words}</span>
    </span>`,
    tools: [
      toolButton("Show in the 3D pane", "cube", () => select(target), { pressed: selected }),
      toolButton("Look again", "again", () => void commands.lookAgain(id)),
      toolButton("Follow", "follow", () => follows.follow({ target_id: id })),
      toolButton("Delete", "trash", () => commands.remove(target)),
    ],
    select: () => select(target),
    rename: (label) => commands.rename(id, label),
  });
}
