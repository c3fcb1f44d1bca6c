// Step 1, the wide camera: views of the board all over the picture and at every tilt, and the accuracy of the lens fit.

import { changing, h, html } from "../../../elements/dom.js";
import { number, pixels } from "../../../elements/format.js";
import { boardForm } from "./board_form.js";
import { drawCoverage, drawTilts } from "./coverage.js";
import { makeFoveaLens } from "./fovea.js";
import { lensTable } from "./models.js";
import { allHold, choiceField, numberField, panel, starter } from "../../../elements/parts.js";
import { figure, picturesOf } from "../pictures.js";
import { mountSamples } from "./samples.js";

/**
 * @import { SessionDocument } from "#api"
 * @import { ConsoleState } from "#page"
 * @import { WizardContext } from "../page.js"
 */

const PICTURES = ["coverage", "wide_residuals"];

/** @param {WizardContext} context */
export function makeWideStep(context) {
  const { store } = context;
  const live = h("div", { class: "live-slot" });
  const cover = h("div", { class: "cover" });
  const samples = h("div", {});
  const lens = h("div", { class: "scroll-x" });
  const diagrams = h("div", { class: "diagrams" });
  const showCover = changing(cover, coverOf);
  const showLens = changing(lens, lensTable);
  const showDiagrams = changing(diagrams, (/** @type {import("#api").PictureDocument[]} */ pictures) =>
    pictures.map(figure),
  );
  mountSamples(samples, {
    store,
    samplesOf: (session) => session?.wide?.samples ?? [],
    remove: (id) => context.orders.removeSample(id, "wide"),
  });
  store.on(["session", "rig"], ({ session, rig }) => {
    const camera = rig?.cameras.find(({ role }) => role === "wide");
    showCover({ wide: session?.wide ?? null, width: camera?.width ?? 1440, height: camera?.height ?? 1080 });
    showLens(session?.wide ?? null);
    showDiagrams(picturesOf(session, PICTURES));
  });
  const element = h(
    "div",
    { class: "step step-wide" },
    html`<div class="seeing">${live}${panel("Views of the board", runForm(context), cover)}</div>`,
    panel("Views taken", samples),
    panel("The lens", lens, diagrams),
    makeFoveaLens(context),
  );
  return { element, live };
}

/** @param {{wide: SessionDocument["wide"], width: number, height: number}} now */
function coverOf({ wide, width, height }) {
  const taken = wide?.samples ?? [];
  const fraction = wide?.coverage_fraction ?? null;
  return [
    drawCoverage(taken, { width, height, cells: wide?.cells ?? null }),
    html`<p class="legend">
      ${
        fraction === null
          ? "Each dot is the middle of one view of the board."
          : `${number(fraction * 100, 0)} % of the picture covered`
      }
    </p>`,
    drawTilts(taken, wide?.tilts_covered ?? null),
  ];
}

/** @param {WizardContext} context */
function runForm({ store, orders }) {
  const board = boardForm();
  const views = numberField("Views wanted", { min: 3, max: 200, hint: "as usual" });
  const model = choiceField("Lens model", [
    ["", "the better one"],
    ["five", "five coefficients"],
    ["rational", "rational"],
  ]);
  const act = () =>
    board.holds() &&
    allHold(views) &&
    orders.run("wide", { board: board.value(), views: views.value(), model: model.value() || null });
  store.on(["session"], ({ session }) => board.put(session?.board ?? null, session?.id));
  const start = starter({
    label: "Take views",
    store,
    act,
    primary: true,
    keys: ["session"],
    named: ({ session }) => (session?.wide?.samples.length ? "Take more views" : "Take views"),
  });
  return html`<form class="run" @submit=${(/** @type {Event} */ event) => event.preventDefault()}>
    <p class="lead">
      Show the board to the wide camera: near and far, in every corner, tilted every way. A view is taken by itself
      when the board is still and adds something new.
    </p>
    <details class="options">
      <summary>Board and options</summary>
      <div class="fields">${[...board.elements, views.element, model.element]}</div>
      <p class="legend">Columns and rows count inner corners: one less than the squares.</p>
    </details>
    <p class="actions">${start}</p>
  </form>`;
}

/** @param {ConsoleState} state */
export function wideProgress({ session }) {
  const wide = session?.wide;
  if (wide?.fit) return { tone: "good", text: pixels(wide.fit.rms_px) };
  return wide?.samples.length
    ? { tone: "plain", text: wide.samples.length === 1 ? "1 view" : `${wide.samples.length} views` }
    : null;
}
