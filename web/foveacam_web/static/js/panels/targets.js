// Lists the targets: name, distance, fixate again, show in 3D, delete.

import { answerText, basisMeaning, basisWords, boundText } from "../answers.js";
import { fill, h, say } from "../dom.js";
import { angle } from "../format.js";
import { icon } from "../icons.js";

/**
 * @import { TargetDocument } from "#api"
 * @import { Commands } from "../commands.js"
 * @import { Store } from "../store.js"
 * @typedef {{element: HTMLLIElement, label: HTMLInputElement, distance: HTMLElement, basis: HTMLElement, pick: HTMLButtonElement, target: TargetDocument}} Row
 * @typedef {{store: Store, commands: Commands, select: (target: TargetDocument) => void}} Context
 */

/**
 * @param {HTMLElement} place
 * @param {Context} context
 */
export function mountTargets(place, context) {
  const list = h("ul", { class: "targets" });
  const empty = h("p", { class: "empty" });
  fill(place, list, empty);
  /** @type {Map<string, Row>} */
  const rows = new Map();
  context.store.on(["targets", "hidden_targets", "selected_target"], ({ targets, hidden_targets, selected_target }) => {
    const shown = (targets ?? []).filter(({ id }) => !hidden_targets.includes(id));
    for (const [id, row] of rows) {
      if (shown.some((target) => target.id === id)) continue;
      row.element.remove();
      rows.delete(id);
    }
    shown.forEach((target, index) => {
      const row = rows.get(target.id) ?? makeRow(target, context);
      rows.set(target.id, row);
      updateRow(row, target, target.id === selected_target);
      if (list.children[index] !== row.element) list.insertBefore(row.element, list.children[index] ?? null);
    });
    empty.hidden = shown.length > 0;
    say(empty, targets === null ? "Loading …" : "Everything that you fixate is listed here.");
  });
}

/**
 * @param {TargetDocument} target
 * @param {Context} context
 * @returns {Row}
 */
function makeRow(target, { commands, select }) {
  const label = h("input", {
    class: "label",
    type: "text",
    "aria-label": "Name of the target",
    maxlength: "80",
    spellcheck: "false",
    autocomplete: "off",
  });
  const distance = h("span", { class: "distance number" });
  const basis = h("span", { class: "basis", hidden: true });
  const known = h("span", { class: "known" }, distance, basis);
  const button = (
    /** @type {string} */ name,
    /** @type {import("../icons.js").IconName} */ picture,
    /** @type {() => void} */ act,
  ) =>
    h("button", { type: "button", class: "tool", "aria-label": name, title: name, on: { click: act } }, icon(picture));
  /** @type {Row} */
  const row = {
    element: h("li", {}),
    label,
    distance,
    basis,
    target,
    pick: button("Show in the 3D pane", "cube", () => select(row.target)),
  };
  row.element.append(
    label,
    known,
    h(
      "span",
      { class: "tools" },
      row.pick,
      button("Look again", "again", () => void commands.lookAgain(row.target.id)),
      button("Delete", "trash", () => commands.remove(row.target.id, row.target.label)),
    ),
  );
  label.addEventListener("change", () => void commands.rename(row.target.id, label.value.trim() || row.target.label));
  label.addEventListener("keydown", (event) => {
    if (event.key === "Escape") label.value = row.target.label;
    if (event.key === "Escape" || event.key === "Enter") label.blur();
    event.stopPropagation(); // keys typed into the name are not the console's
  });
  row.element.addEventListener("click", (event) => {
    if (event.target === row.element || known.contains(/** @type {Node} */ (event.target))) select(row.target);
  });
  return row;
}

/**
 * @param {Row} row
 * @param {TargetDocument} target
 * @param {boolean} selected
 */
function updateRow(row, target, selected) {
  row.target = target;
  row.element.classList.toggle("selected", selected);
  row.pick.setAttribute("aria-pressed", String(selected));
  if (document.activeElement !== row.label && row.label.value !== target.label) row.label.value = target.label;
  row.label.title = target.label;
  say(row.distance, answerText(target));
  row.distance.title = `${angle(target.ax_deg)} ${angle(target.ay_deg)}${target.bound ? `, ${boundText(target.bound)}` : ""}`;
  row.element.dataset["basis"] = target.basis;
  row.basis.hidden = target.basis === "both_foveae" && !target.corrections?.length;
  say(
    row.basis,
    [basisWords(target.basis, target), target.corrections?.length ? "corrected" : ""].filter(Boolean).join(", "),
  );
  row.basis.title = basisMeaning(target.basis);
}
