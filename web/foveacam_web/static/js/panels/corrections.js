// Buttons that correct an answer: choose another alternative, or fixate again nearer or farther.

import { answerText, basisOf, basisWords, chosenOf, percent } from "../answers.js";
import { h } from "../dom.js";
import { icon } from "../icons.js";

/**
 * @import { FixationDocument } from "#api"
 * @import { Commands } from "../commands.js"
 */

/**
 * List the alternative distances, each with its probability.
 * @param {FixationDocument} fixation
 * @param {Commands} commands
 */
export function alternatives(fixation, commands) {
  if (!fixation.alternatives?.length) return null;
  const chosen = chosenOf(fixation);
  const rows = fixation.alternatives.map((each, index) =>
    h(
      "li",
      {},
      h(
        "button",
        {
          type: "button",
          class: "plain alternative",
          "aria-pressed": String(each === chosen),
          data: { keep: `alternative-${index}` },
          on: { click: () => void commands.choose(fixation, index) },
        },
        h("span", { class: "number", text: answerText(each) }),
        h("span", { class: "basis", text: basisWords(each.basis, fixation) }),
        h("span", { class: "number chance", text: percent(each.probability) }),
      ),
    ),
  );
  return h(
    "div",
    { class: "alternatives" },
    h("p", {
      class: "lead",
      text: chosen ? "Chosen of these:" : `${rows.length} distances are possible. Which one is it?`,
    }),
    h("ul", {}, rows),
  );
}

/**
 * @param {FixationDocument} fixation
 * @param {Commands} commands
 */
export function nearerOrFarther(fixation, commands) {
  if (!basisOf(fixation)) return null;
  const button = (
    /** @type {"nearer" | "farther"} */ direction,
    /** @type {import("../icons.js").IconName} */ picture,
  ) =>
    h(
      "button",
      {
        type: "button",
        class: "plain",
        data: { keep: direction },
        title: `Look again, only ${direction} than this answer`,
        on: { click: () => void commands.correct(fixation, direction) },
      },
      icon(picture),
      direction === "nearer" ? "Nearer" : "Farther",
    );
  return h(
    "p",
    { class: "correct" },
    h("span", { class: "ask", text: "Not right? It is" }),
    button("nearer", "low"),
    button("farther", "up"),
  );
}
