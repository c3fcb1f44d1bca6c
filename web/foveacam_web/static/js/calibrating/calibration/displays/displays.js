// Chooses the pattern that displays show at its true size, and lists the displays that are connected.

import { absent, changing, h, html } from "../../../elements/dom.js";
import { icon } from "../../../elements/icons.js";
import { allHold, badge, choiceField, nothing, numberField, textButton } from "../../../elements/parts.js";
import { FIELDS_OF, PAPER_NAMES, PATTERN_NAMES, displayState, patternOf, printPath, sizeWords } from "./words.js";
import { API, ROOT } from "../../../root.js";

/**
 * @import { DisplayDocument, PatternDocument } from "#api"
 * @import { PatternField, PatternKind } from "#page"
 * @import { NumberField } from "../../../elements/parts.js"
 * @import { WizardContext } from "../page.js"
 */

/** @param {HTMLElement} place @param {WizardContext} context */
export function mountDisplays(place, context) {
  const { store } = context;
  const shown = h("div", { role: "status" });
  const list = h("div", { class: "displays" });
  place.append(h("div", { class: "stack" }, lead(), formOf(context), shown, list));
  const showShown = changing(shown, shownOf);
  const showList = changing(list, listOf);
  store.on(["displays", "display_pattern"], ({ displays, display_pattern }) => {
    showShown(display_pattern);
    showList(displays?.map((display) => ({ ...display, silent_s: 0 })) ?? null);
  });
}

function lead() {
  return html`<p class="lead">
    A tablet or monitor before the rig can be the board: open <a href="${ROOT}/display" target="_blank">${location.origin}${ROOT}/display</a> on it, set
    its size there once, and choose here what it shows.
  </p>`;
}

/** @param {WizardContext} context */
function formOf({ store, orders }) {
  const fields = fieldsOf();
  const kind = choiceField("Pattern", /** @type {[string, string][]} */ (Object.entries(PATTERN_NAMES)), () => offer());
  const paper = choiceField("Paper", PAPER_NAMES);
  const chosen = () => /** @type {PatternKind} */ (kind.value());
  const offer = () => {
    for (const [name, field] of entriesOf(fields)) field.element.hidden = !FIELDS_OF[chosen()].includes(name);
  };
  const described = () =>
    allHold(...Object.values(fields)) ? patternOf(chosen(), (name) => fields[name].value()) : null;
  const show = () => {
    const pattern = described();
    if (pattern) void orders.showPattern(pattern);
  };
  const print = () => {
    const pattern = described();
    if (pattern) void orders.save(printPath(pattern, paper.value()));
  };
  offer();
  let known = "";
  store.on(["display_pattern"], ({ display_pattern }) => {
    const pattern = display_pattern?.pattern;
    if (!pattern || pattern.kind === "blank" || JSON.stringify(pattern) === known) return;
    known = JSON.stringify(pattern);
    kind.put(pattern.kind);
    for (const [name, value] of Object.entries(pattern)) {
      if (typeof value === "number") fields[/** @type {PatternField} */ (name)].put(value);
    }
    offer();
  });
  const submit = (/** @type {Event} */ event) => {
    event.preventDefault();
    show();
  };
  return html`<form class="run" @submit=${submit}>
    <div class="fields">${kind.element}${Object.values(fields).map(({ element }) => element)}</div>
    <p class="actions">
      <button type="submit" class="plain primary">Show</button>
      ${textButton("Blank", () => orders.showPattern({ kind: "blank" }))}
    </p>
    <div class="fields">
      ${paper.element}
      ${textButton("Print (PDF)", print, { picture: "down" })}
    </div>
    <p class="lead">
      Print at 100 % and measure the ruler on the sheet. What is larger than the paper comes on several sheets with crop marks.
    </p>
  </form>`;
}

/** @returns {Record<PatternField, NumberField>} */
function fieldsOf() {
  const side = { min: 0.5, max: 1000, step: /** @type {"any"} */ ("any"), unit: "mm" };
  return {
    columns: numberField("Columns", { value: 9, min: 3, max: 40 }),
    rows: numberField("Rows", { value: 6, min: 3, max: 40 }),
    square_mm: numberField("Square", { ...side, value: 20 }),
    marker_mm: numberField("Marker", { ...side, value: 15 }),
    id: numberField("Id", { value: 0, min: 0, max: 49 }),
    side_mm: numberField("Side", { ...side, value: 60 }),
    spacing_mm: numberField("Spacing", { ...side, value: 100 }),
  };
}

/** @param {Record<PatternField, NumberField>} fields */
function entriesOf(fields) {
  return /** @type {[PatternField, NumberField][]} */ (Object.entries(fields));
}

/** @param {PatternDocument | null} shown */
function shownOf(shown) {
  if (!shown) return nothing("The server has not answered yet.");
  if (shown.pattern.kind === "blank") return html`<p class="lead">Displays are blank.</p>`;
  const board = shown.pattern.kind === "charuco" || shown.pattern.kind === "checkerboard";
  return html`<p>Displays show: <b>${shown.description}</b>, ${sizeWords(shown.width_mm, shown.height_mm)} with its edge.</p>
    ${board && html`<p class="lead">Step 1 needs the same numbers: enter them under “Board and options” there.</p>`}
    <p class="lead">
      <a href="${API}/displays/pattern.svg" target="_blank" rel="noopener">${icon("file")} The drawing</a> as SVG.
    </p>`;
}

/** @param {DisplayDocument[] | null} displays */
function listOf(displays) {
  if (!displays) return "";
  if (displays.length === 0) return nothing("No display is connected.");
  const row = (/** @type {DisplayDocument} */ display) => {
    const { tone, text } = displayState(display);
    return html`<li>
      <span class="name" title=${display.px_per_mm === null ? absent : `${display.px_per_mm.toFixed(3)} px/mm`}>
        ${display.name}, ${display.width_px} × ${display.height_px} px
      </span>
      ${badge(tone, text)}
    </li>`;
  };
  return html`<ul aria-label="Connected displays">${displays.map(row)}</ul>`;
}
