// The page that compares two depth backends on the newest look: split slider, difference, and histogram of differences.

import { request } from "../../transport/api.js";
import "../../elements/plot.js";
import { fill, h, html, update } from "../../elements/dom.js";
import { pageHead } from "../../pages.js";
import { figures, nothing, panel, textButton } from "../../elements/parts.js";
import { waiting } from "../../elements/waiting.js";
import { backendWords } from "../../video/depth_words.js";
import { differenceRows, firstPair, histogramCurves, researchOnly, sideRows } from "./words.js";

/**
 * @import { BackendComparisonDocument, DepthBackendsDocument } from "#api"
 * @import { Commands, Store } from "#console"
 * @import { PlotSpec } from "../../elements/plot.js"
 * @typedef {{first: string, second: string}} Chosen
 */

const PATIENCE_MS = 120_000; // a network on a slow machine takes a while

/** @param {HTMLElement} place @param {{store: Store, commands: Commands}} context */
export function mountComparePage(place, { store, commands }) {
  const body = h("div", { class: "compare-body" });
  /** @type {{backends: DepthBackendsDocument | null, chosen: Chosen, found: BackendComparisonDocument | null, busy: boolean, confirmed: boolean}} */
  const state = { backends: null, chosen: { first: "", second: "" }, found: null, busy: false, confirmed: false };
  let runs = 0;
  const draw = () => update(body, content());

  const open = async () => {
    state.backends = await commands.attempt(
      () => /** @type {Promise<DepthBackendsDocument>} */ (request("GET", "/depth/backends")),
    );
    const names = state.backends?.backends.map(({ name }) => name) ?? [];
    if (state.backends && !(names.includes(state.chosen.first) && names.includes(state.chosen.second)))
      state.chosen = firstPair(state.backends);
    draw();
  };
  /** Stop waiting for the answer; the server ends its computation by itself. */
  const giveUp = () => {
    runs += 1;
    state.busy = false;
    draw();
  };
  const compare = async () => {
    const run = ++runs;
    state.busy = true;
    draw();
    const body = { ...state.chosen, research_confirmed: state.confirmed };
    const found = await commands.attempt(
      () =>
        /** @type {Promise<BackendComparisonDocument>} */ (
          request("POST", "/depth/comparisons", { body, patience_ms: PATIENCE_MS })
        ),
    );
    if (run !== runs) return; // it was given up
    state.found = found ?? state.found;
    state.busy = false;
    draw();
  };

  const content = () => {
    const { backends, chosen, found, busy } = state;
    if (!backends) return waiting("Loading the list of backends");
    const research = researchOnly(backends, [chosen.first, chosen.second]);
    const same = chosen.first === chosen.second;
    return html`<section class="panel" aria-label="What is compared">
        <div class="inside compare-choice">
          ${chooser("Left of the slider", "first")} ${chooser("Right of it", "second")}
          ${
            research.length > 0 &&
            html`<label class="field tick"
              ><input
                type="checkbox" .checked=${state.confirmed}
                @change=${(/** @type {{currentTarget: HTMLInputElement}} */ { currentTarget }) => {
                  state.confirmed = currentTarget.checked;
                  draw();
                }}
              /><span>This is research: the licence of ${research.join(" and ")} allows nothing else</span></label
            >`
          }
          ${textButton("Compare on the newest look", () => compare(), {
            kind: "plain primary",
            disabled: busy || same || (research.length > 0 && !state.confirmed),
          })}
          ${same && html`<span class="note">Choose two different ones.</span>`}
        </div>
      </section>
      ${busy && waiting(`${chosen.first} and ${chosen.second} compute the depth of the newest look`, giveUp)}
      ${found ? resultOf(found) : !busy && nothing("Click something in the console, then compare: both backends compute the depth of that look.")}`;
  };
  /** @param {string} label @param {keyof Chosen} side */
  const chooser = (label, side) => html`<label class="field"
    ><span>${label}</span
    ><select
      .value=${state.chosen[side]}
      @change=${(/** @type {{currentTarget: HTMLSelectElement}} */ { currentTarget }) => {
        state.chosen = { ...state.chosen, [side]: currentTarget.value };
        draw();
      }}
    >
      ${state.backends?.backends.map(
        (backend) =>
          html`<option value=${backend.name} ?selected=${backend.name === state.chosen[side]} ?disabled=${backend.problem !== null}>
            ${backendWords(backend)}
          </option>`,
      )}
    </select></label
  >`;

  fill(place, pageHead("compare-title", "Compare depth"), body);
  store.on(["compare_page"], ({ compare_page }) => {
    if (compare_page) void open();
  });
}

/** @param {BackendComparisonDocument} found */
function resultOf(found) {
  const { measured, expected } = histogramCurves(found);
  /** @type {PlotSpec} */
  const spec = {
    words: "Histogram of the differences, in stated standard errors, and the normal distribution",
    height: 190,
    x: { name: "difference, in its stated standard errors", from: found.edges[0] ?? -1, to: found.edges.at(-1) ?? 1 },
    y: { name: "share of pixels" },
    curves: [
      { name: "measured", colour: "--accent", runs: [measured] },
      { name: "expected", colour: "--text-soft", dash: [4, 3], runs: [expected] },
    ],
  };
  return html`<div class="compare-result">
    ${panel("Depth", slider(found))}
    ${panel(
      "First minus second",
      html`<img class="compare-picture" src=${found.difference_url} alt="Difference of the disparities" />
        <p class="note">
          Red: ${found.first.name} finds a larger disparity, it is nearer; blue: farther. Full colour at ${found.limit_px} px;
          dark: unknown to one of them.
        </p>
        ${figures(differenceRows(found))}`,
    )}
    ${panel(
      "Difference against the stated errors",
      html`<value-plot .spec=${spec}></value-plot>`,
      html`<p class="note">
        Dashed: two independent errors, stated correctly. Narrower: common noise, or stated errors too large; wider: at
        least one stated error is too small. The outermost bins hold what is beyond.
      </p>`,
    )}
    ${panel(found.first.name, figures(sideRows(found.first)))} ${panel(found.second.name, figures(sideRows(found.second)))}
  </div>`;
}

/** @param {BackendComparisonDocument} found */
function slider({ first, second }) {
  return html`<div class="compare-split">
      <img src=${second.picture_url} alt=${`Depth by ${second.name}`} />
      <img class="over" src=${first.picture_url} alt=${`Depth by ${first.name}`} />
      <span class="side left">${first.name}</span><span class="side right">${second.name}</span>
    </div>
    <input
      type="range" class="compare-slider" min="0" max="100" value="50" aria-label="Where the two pictures meet"
      @input=${(/** @type {{currentTarget: HTMLInputElement}} */ { currentTarget }) =>
        /** @type {HTMLElement} */ (currentTarget.previousElementSibling).style.setProperty(
          "--meet",
          `${currentTarget.value}%`,
        )}
    />`;
}
