// Step 1, the wide camera: views of the board all over the picture and at every tilt, and the accuracy of the lens fit.

import { changing, h, html } from "../dom.js";
import { number, pixels } from "../format.js";
import { drawCoverage, drawTilts } from "./coverage.js";
import { lensTable } from "./lens.js";
import { allHold, choiceField, numberField, panel, starter } from "../parts.js";
import { figure, picturesOf } from "./pictures.js";
import { mountSamples } from "./samples.js";

/**
 * @import { BoardDocument, SessionDocument } from "#api"
 * @import { ConsoleState } from "#page"
 * @import { WizardContext } from "./page.js"
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
  mountSamples(samples, context);
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
  const kind = choiceField(
    "Board",
    [
      ["charuco", "ChArUco"],
      ["checkerboard", "Checkerboard"],
    ],
    () => offer(),
  );
  const columns = numberField("Columns", { min: 3, max: 40 });
  const rows = numberField("Rows", { min: 3, max: 40 });
  const square = numberField("Square", { min: 0.5, max: 500, step: "any", unit: "mm" });
  const marker = numberField("Marker", { min: 0.3, max: 500, step: "any", unit: "mm" });
  const views = numberField("Views wanted", { min: 3, max: 200, hint: "as usual" });
  const model = choiceField("Lens model", [
    ["", "the better one"],
    ["five", "five coefficients"],
    ["rational", "rational"],
  ]);
  const offer = () => (marker.element.hidden = kind.value() !== "charuco");
  const act = () =>
    allHold(columns, rows, square, marker, views) &&
    orders.run("wide", {
      board: boardOf(kind.value(), columns.value(), rows.value(), square.value(), marker.value()),
      views: views.value(),
      model: model.value() || null,
    });
  fillBoard(store, { kind, columns, rows, square, marker, offer });
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
      <div class="fields">${[kind, columns, rows, square, marker, views, model].map(({ element }) => element)}</div>
      <p class="legend">Columns and rows count inner corners: one less than the squares.</p>
    </details>
    <p class="actions">${start}</p>
  </form>`;
}

/**
 * Return the board that the options name; null when the fields are empty and the session's own is used.
 * @param {string} kind
 * @param {number | null} columns
 * @param {number | null} rows
 * @param {number | null} square_mm
 * @param {number | null} marker_mm
 * @returns {BoardDocument | null}
 */
function boardOf(kind, columns, rows, square_mm, marker_mm) {
  if (columns === null || rows === null || square_mm === null) return null;
  return {
    kind: kind === "checkerboard" ? "checkerboard" : "charuco",
    columns,
    rows,
    square_mm,
    marker_mm: kind === "charuco" ? marker_mm : null,
  };
}

/**
 * Fill the fields with the session's board whenever it changes.
 * @param {import("../store.js").Store} store
 * @param {{kind: {input: HTMLSelectElement}, columns: import("../parts.js").NumberField, rows: import("../parts.js").NumberField,
 *   square: import("../parts.js").NumberField, marker: import("../parts.js").NumberField, offer: () => unknown}} fields
 */
function fillBoard(store, { kind, columns, rows, square, marker, offer }) {
  let known = "";
  store.on(["session"], ({ session }) => {
    const now = JSON.stringify(session?.board ?? null);
    if (now === known) return;
    known = now;
    const board = session?.board;
    kind.input.value = board?.kind ?? "charuco";
    columns.input.value = String(board?.columns ?? "");
    rows.input.value = String(board?.rows ?? "");
    square.input.value = String(board?.square_mm ?? "");
    marker.input.value = String(board?.marker_mm ?? "");
    offer();
  });
}

/** @param {ConsoleState} state */
export function wideProgress({ session }) {
  const wide = session?.wide;
  if (wide?.fit) return { tone: "good", text: pixels(wide.fit.rms_px) };
  return wide?.samples.length
    ? { tone: "plain", text: wide.samples.length === 1 ? "1 view" : `${wide.samples.length} views` }
    : null;
}
