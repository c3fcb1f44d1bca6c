// Step 3, the fit: mirror and rectification models chosen by cross-validation, shown beside the paper's.

import { changing, h, html } from "../../../elements/dom.js";
import { number, pixels, sentence } from "../../../elements/format.js";
import { facts, parts, sentenceNames, sentences } from "../facts.js";
import { fieldTable, mirrorTable, paperTable } from "./tables.js";
import { knockWords } from "./knocks.js";
import { choiceField, figures, nothing, panel, starter, tickField } from "../../../elements/parts.js";
import { beforeAfter, figure, picturesOf } from "../pictures.js";

/**
 * @import { FitDocument, PictureDocument } from "#api"
 * @import { ConsoleState } from "#page"
 * @import { WizardContext } from "../page.js"
 */

const DIAGRAMS = ["quiver_left", "quiver_right", "loo", "mount_drift", "warp_left", "warp_right"];
const PAIR = ["anaglyph_before", "anaglyph_after"];

/** @param {WizardContext} context */
export function makeFitStep(context) {
  const { store } = context;
  const models = h("div", { class: "stack" });
  const paper = h("div", { class: "stack" });
  const parallax = h("div", {});
  const mounts = h("div", {});
  const pair = h("div", {});
  const diagrams = h("div", { class: "diagrams" });
  const showModels = changing(models, (/** @type {FitDocument | null} */ fit) => [
    ...mirrorTable(fit),
    ...fieldTable(fit),
  ]);
  const showPaper = changing(paper, paperTable);
  const showParallax = changing(parallax, parallaxOf);
  const showMounts = changing(mounts, mountsOf);
  const showPair = changing(pair, pairOf);
  const showDiagrams = changing(diagrams, (/** @type {PictureDocument[]} */ pictures) =>
    pictures.length ? pictures.map(figure) : [nothing("The diagrams appear here once a fit has drawn them.")],
  );
  store.on(["session"], ({ session }) => {
    showModels(session?.fit ?? null);
    showPaper(session?.fit ?? null);
    showParallax(session?.fit ?? null);
    showMounts(session?.fit?.drift ?? null);
    showPair(picturesOf(session, PAIR));
    showDiagrams(picturesOf(session, DIAGRAMS));
  });
  const element = h(
    "div",
    { class: "step step-fit" },
    html`<div class="seeing">
      ${panel("Fit", runForm(context))}
      <div class="stack">${panel("Parallax of the markers", parallax)}${panel("Drift while measuring", mounts)}</div>
    </div>`,
    panel("Models, by the error on poses left out", models, paper),
    panel("Both eyes, before and after", pair),
    panel("Diagrams", diagrams),
  );
  return { element, live: null };
}

/** @param {WizardContext} context */
function runForm({ store, orders }) {
  const label = h("input", {
    type: "text",
    id: "fit-label",
    maxlength: 80,
    placeholder: "as the measurement",
    autocomplete: "off",
  });
  const order = choiceField("Order of the mirrors’ polynomial", [
    ["", "by cross-validation"],
    ...["2", "3", "4", "5", "6", "7", "8", "9"].map((each) => /** @type {[string, string]} */ ([each, each])),
  ]);
  const all = tickField("Use every marker distance: finds the pupils' walk and the baseline", true);
  const act = () =>
    orders.run("fit", {
      label: label.value.trim() || null,
      order: order.value() ? Number(order.value()) : null,
      use_all_distances: all.value(),
    });
  const start = starter({
    label: "Fit",
    store,
    act,
    primary: true,
    keys: ["session"],
    why: against,
    named: ({ session }) => (session?.fit ? "Fit again" : "Fit"),
  });
  return html`<form class="run" @submit=${(/** @type {Event} */ event) => event.preventDefault()}>
    <p class="lead">
      What was measured stays as it is: fit as often as you like, with another order or with one distance alone. Each
      fit is a record of its own.
    </p>
    <div class="fields">
      <div class="field"><label for="fit-label">Label</label>${label}</div>
      ${order.element}
      ${all.element}
    </div>
    <p class="actions">${start}</p>
  </form>`;
}

/** @param {ConsoleState} state */
function against({ session }) {
  if (!session?.wide?.fit) return "First step 1: without the wide lens no marker's direction is known.";
  return session.sweeps.some(({ done }) => done > 0) ? null : "First step 2: there is nothing to fit yet.";
}

/** @param {FitDocument | null} fit */
function parallaxOf(fit) {
  if (!fit?.parallax)
    return [
      nothing(
        "The eyes stand beside the wide camera, so each sees its marker at a slightly different angle. The fit shows here how large that was, and whether it could be corrected.",
      ),
    ];
  const stations = parts(fit.parallax);
  if (stations.length === 0) return report(fit.parallax);
  return stations.flatMap(([station, parallax]) => [html`<h4>Station “${station}”</h4>`, ...report(parallax)]);
}

/** @param {FitDocument["drift"]} drift */
function mountsOf(drift) {
  const knocked = knockWords(drift);
  if (!drift)
    return [
      nothing(
        "While they warm up, the eyes’ mounts move by fractions of a pixel. Repeated nodes measure this drift; the fit refers everything to the end.",
      ),
    ];
  return [
    html`<p class="lead">
      Drift of each eye’s mount between the first node and the last; it was corrected.
    </p>`,
    figures(
      Object.entries(drift).map(([eye, { moved_px, sigma_px, minutes }]) => [
        eye,
        `${pixels(moved_px)} ± ${number(sigma_px, 2)} in ${number(minutes, 1)} min`,
      ]),
    ),
    knocked && html`<p class="lead">${knocked}</p>`,
  ];
}

/** @param {Record<string, unknown>} document */
function report(document) {
  return [
    ...sentences(document).map((text) => html`<p class="lead">${sentence(text)}</p>`),
    figures(facts(document, sentenceNames(document))),
  ];
}

/** @param {PictureDocument[]} pictures */
function pairOf(pictures) {
  const [before, after] = pictures;
  if (before && after) return [beforeAfter(before, after)];
  return pictures.length
    ? pictures.map(figure)
    : [nothing("The anaglyph of both foveae appears here, raw and rectified.")];
}

/** @param {ConsoleState} state */
export function fitProgress({ session }) {
  return session?.fit ? { tone: "good", text: "fitted" } : null;
}
