// The lens of a fovea by views of a small board, beside the step of the wide camera. It informs.

import { changing, h, html } from "../../../elements/dom.js";
import { number, pixels, sentence } from "../../../elements/format.js";
import { choiceField, figures, nothing, numberField, allHold, panel, starter } from "../../../elements/parts.js";
import { boardForm } from "./board_form.js";
import { parameterRows } from "./words.js";
import { figure, picturesOf } from "../pictures.js";
import { mountSamples } from "./samples.js";

/**
 * @import { LensDocument, PictureDocument, SessionDocument } from "#api"
 * @import { WizardContext } from "../page.js"
 */

/** @param {WizardContext} context */
export function makeFoveaLens(context) {
  const { store, orders } = context;
  const samples = h("div", {});
  const result = h("div", { class: "stack" });
  const diagrams = h("div", { class: "diagrams" });
  const camera = choiceField(
    "Camera",
    [
      ["left", "Left fovea"],
      ["right", "Right fovea"],
    ],
    () => show(store.state.session),
  );
  const board = boardForm();
  const shown = (/** @type {SessionDocument | null} */ session) =>
    session?.lenses.find((lens) => lens.camera === camera.value()) ?? null;
  const views_taken = mountSamples(samples, {
    store,
    samplesOf: (session) => shown(session)?.samples ?? [],
    remove: (id) => orders.removeSample(id, camera.value()),
  });
  const showResult = changing(result, resultOf);
  const showDiagrams = changing(diagrams, (/** @type {PictureDocument[]} */ pictures) => pictures.map(figure));
  const show = (/** @type {SessionDocument | null} */ session) => {
    const lens = shown(session);
    board.put(lens?.board ?? null, session && `${session.id} ${camera.value()}`);
    views_taken.show();
    showResult(lens);
    showDiagrams(picturesOf(session, [`lens_${camera.value()}`]));
  };
  store.on(["session"], ({ session }) => show(session));
  return panel("Lens of a fovea", runForm(context, { camera, board }), samples, result, diagrams);
}

/**
 * @param {WizardContext} context
 * @param {{camera: ReturnType<typeof choiceField>, board: import("./board_form.js").BoardForm}} fields
 */
function runForm({ store, orders }, { camera, board }) {
  const views = numberField("Views wanted", { min: 3, max: 200, hint: "18" });
  const start = starter({
    label: "Take views",
    store,
    act: () =>
      board.holds() &&
      allHold(views) &&
      orders.run("lens", { camera: camera.value(), board: board.value(), views: views.value() }),
  });
  return html`<form class="run" @submit=${(/** @type {Event} */ event) => event.preventDefault()}>
    <p class="lead">
      For information: focal length, distortion and field of one telephoto lens. Nothing here changes a calibration: the
      rectification of the foveae depends on their mirrors and is fitted in a step of its own.
    </p>
    <p class="lead">
      Show a small board straight before the fovea, whose mirror rests at 0 V: as large as its picture, at 2.4 m and
      farther, tilted by 30 to 45° to all sides. A view is taken by itself when the board is still.
    </p>
    <div class="fields">${camera.element}</div>
    <details class="options">
      <summary>Board and options</summary>
      <div class="fields">${[...board.elements, views.element]}</div>
      <p class="legend">
        Left empty: a ChArUco board of 9 × 6 inner corners, squares of 12 mm, markers of 9 mm. Print it: foveacam board
        charuco --squares 10x7 --square-mm 12 --marker-mm 9.
      </p>
    </details>
    <p class="actions">${start}</p>
  </form>`;
}

/** @param {LensDocument | null} lens */
function resultOf(lens) {
  if (!lens) return null;
  const { fit, reason } = lens;
  if (!fit) return nothing(sentence(reason));
  return [
    figures([
      ["Field of view", `${number(fit.fov_x_deg, 3)}° × ${number(fit.fov_y_deg, 3)}°`],
      ["RMS", pixels(fit.rms_px)],
      ["Camera matrix", matrixOf(fit)],
    ]),
    html`<div class="scroll-x"><table class="compare">
      <thead><tr>${["Parameter", "Value", "Known from"].map((text) => html`<th scope="col">${text}</th>`)}</tr></thead>
      <tbody>
        ${parameterRows(fit.parameters).map(
          ({ name, value, from }) => html`<tr><th scope="row">${name}</th><td>${value}</td><td>${from}</td></tr>`,
        )}
      </tbody>
    </table></div>`,
    html`<p class="legend">
      Assumed: not determined by the views; its uncertainty is part of the ± of the focal length.
    </p>`,
  ];
}

/** @param {NonNullable<LensDocument["fit"]>} fit */
function matrixOf({ fx_px, fy_px, cx_px, cy_px }) {
  const rows = [
    [number(fx_px, 1), "0", number(cx_px, 1)],
    ["0", number(fy_px, 1), number(cy_px, 1)],
    ["0", "0", "1"],
  ];
  const line = (/** @type {string[]} */ row) => row.map((cell) => cell.padStart(8)).join("");
  return html`<span class="matrix">${rows.map((row) => html`<span>${line(row)}</span>`)}</span>`;
}
