// Draws the targets over the wide picture, each with its label where there is room for it.

import { answerText } from "../looking/answers.js";
import { svg } from "../elements/dom.js";
import { valueArea } from "../looking/measure/drawing.js";
import { visibleIn } from "../looking/measure/state.js";
import { cut, placeLabels } from "./labels.js";

/**
 * @import { ConsoleState, Point } from "#page"
 * @import { LabelPlace } from "./labels.js"
 * @import { Viewport } from "./viewport.js"
 */

/** What the marks depend on. @type {(keyof ConsoleState)[]} */
export const MARKS_DEPEND_ON = [
  "targets",
  "hidden_targets",
  "selected_target",
  "measurements",
  "hidden_measurements",
  "selected_measurement",
  "current",
  "settings",
];

/** Return the marks of the targets, the selected one last, over the others. @param {ConsoleState} state @param {Viewport} viewport */
export function targetMarks(state, viewport) {
  const marks = shownTargets(state, viewport);
  const places = placeLabels(marks, viewport.size, measuredAreas(state, viewport));
  const drawn = marks.map(({ target, at, text }, index) => {
    const selected = target.id === state.selected_target ? " selected" : "";
    return mark(at, `mark basis-${target.basis}${selected}`, text, places[index] ?? null);
  });
  return drawn.reverse();
}

/**
 * Return the targets to draw, the selected one first, with their positions in CSS px and their labels.
 * @param {ConsoleState} state
 * @param {Viewport} viewport
 */
function shownTargets({ targets, hidden_targets, selected_target, settings }, viewport) {
  const kept = settings.marks ? (targets ?? []).filter(({ id }) => !hidden_targets.includes(id)) : [];
  const chosen_first = [...kept].sort((a, b) => Number(b.id === selected_target) - Number(a.id === selected_target));
  return chosen_first.flatMap((target) => {
    if (target.x_px === null || target.y_px === null) return [];
    const at = viewport.toCss({ x: target.x_px, y: target.y_px });
    const label = cut(target.label);
    return [{ target, at, text: target.id === selected_target ? `${label}  ${answerText(target)}` : label }];
  });
}

/** Return where values of measurements are written, CSS px. @param {ConsoleState} state @param {Viewport} viewport */
function measuredAreas(state, viewport) {
  const chosen = visibleIn(state, "wide").filter(({ id }) => id === state.selected_measurement);
  return chosen.map((measured) => valueArea(measured, "wide", viewport));
}

/** @param {Point} at CSS px @param {string} kind @param {string} label @param {LabelPlace | null} place */
function mark({ x, y }, kind, label, place) {
  return svg`<g class=${kind}>
    <path d="M${x} ${y - 5}l5 5l-5 5l-5 -5z"></path>
    ${place && svg`<text x=${place.x} y=${place.y} text-anchor=${place.anchor}>${label}</text>`}
  </g>`;
}
