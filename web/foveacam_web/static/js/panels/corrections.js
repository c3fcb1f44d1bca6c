// Buttons that correct an answer: choose another alternative, or fixate again nearer or farther.

import { answerText, basisOf, basisWords, chosenOf, percent } from "../looking/answers.js";
import { html } from "../elements/dom.js";
import { textButton } from "../elements/parts.js";

/**
 * @import { FixationDocument } from "#api"
 * @import { Commands } from "#console"
 */

const LEAST_NONE = 0.01; // a smaller rest is rounding

/**
 * List the alternative distances, each with its probability.
 * @param {FixationDocument} fixation
 * @param {Commands} commands
 */
export function alternatives(fixation, commands) {
  if (!fixation.alternatives?.length) return null;
  const chosen = chosenOf(fixation);
  const rows = fixation.alternatives.map(
    (each, index) =>
      html`<li>
      <button
        type="button" class="plain alternative" aria-pressed=${String(each === chosen)}
        @click=${() => void commands.choose(fixation, index)}
      >
        <span class="number">${answerText(each)}</span>
        <span class="basis">${basisWords(each.basis, fixation)}</span>
        <span class="number chance">${percent(each.probability)}</span>
      </button>
    </li>`,
  );
  const none = 1 - fixation.alternatives.reduce((sum, each) => sum + each.probability, 0);
  return html`<div class="alternatives">
    <p class="lead">${chosen ? "Chosen of these:" : `${rows.length} distances are possible. Which one is it?`}</p>
    <ul>${rows}</ul>
    ${none > LEAST_NONE ? html`<p class="lead">None of these: ${percent(none)}</p>` : null}
  </div>`;
}

/** @param {FixationDocument} fixation @param {Commands} commands */
export function nearerOrFarther(fixation, commands) {
  if (!basisOf(fixation)) return null;
  const button = (
    /** @type {"nearer" | "farther"} */ direction,
    /** @type {import("../elements/icons.js").IconName} */ picture,
  ) =>
    textButton(direction === "nearer" ? "Nearer" : "Farther", () => commands.correct(fixation, direction), {
      picture,
      title: `Look again, only ${direction} than this answer`,
    });
  return html`<p class="correct">
    <span class="ask">Not right? It is</span>
    ${button("nearer", "low")}
    ${button("farther", "up")}
  </p>`;
}
