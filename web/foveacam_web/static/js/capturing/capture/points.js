// Fields for the source of the points: a grid of angles over a field, or a text in the set-point language.

import { choiceField, numberField, textButton } from "../../elements/parts.js";
import { h, html, setText } from "../../elements/dom.js";
import { asked, named, segments } from "./parts.js";

/**
 * @import { PlanDraft } from "#page"
 * @import { Troubles } from "./parts.js"
 */

/** @type {Record<PlanDraft["field"], {across: string, down: string, unit: string, usual: [number, number], note: string}>} */
const EXTENTS = {
  all: {
    across: "",
    down: "",
    unit: "",
    usual: [0, 0],
    note: "The whole field that both eyes reach at the distance where they meet, in steps of 0.1°.",
  },
  extent: {
    across: "To each side",
    down: "Up and down",
    unit: "°",
    usual: [5, 4],
    note: "From the centre to the outermost points.",
  },
  step: { across: "Step across", down: "Step down", unit: "°", usual: [1, 1], note: "Between neighbouring points." },
  overlap: {
    across: "Overlap across",
    down: "Overlap down",
    unit: "%",
    usual: [30, 20],
    note: "The share of a view that its neighbour shows too. Views are turned towards the edges: see the least overlap.",
  },
};

const LANGUAGE = [
  ["x°, y°[, distance m][, shift°]", "a point: right, down; the distance a number, inf, or - for the plan's"],
  ["# words", "a comment"],
  ["@add a b c d   @sub   @mul   @div", "changes all points above, column by column; - leaves one alone"],
  ["@delete 3   @delete 0:5   @delete -2:", "takes points away, counted from 0"],
  ["@interpolate 9 9 zigzag", "puts a grid between the last four points, the corners"],
  ["@reverse", "turns the order round"],
];

/**
 * @param {Troubles} troubles
 * @param {() => string | null} asText writes the last estimated grid in the set-point language
 * @param {() => void} changed
 */
export function makePoints(troubles, asText, changed) {
  const source = segments(
    "Where the points come from",
    /** @type {[PlanDraft["source"], string][]} */ ([
      ["grid", "Grid of angles"],
      ["set_points", "Set points"],
    ]),
  );
  const [grid, text] = [makeGrid(troubles), makeText(troubles, asText, changed)];
  const show = () => {
    for (const [name, part] of /** @type {const} */ ([
      ["grid", grid.element],
      ["set_points", text.element],
    ])) {
      part.hidden = source.value() !== name;
      part.toggleAttribute("data-off", part.hidden);
    }
    grid.show();
  };
  show();
  const own = named({ source, text });
  return {
    element: h("div", { class: "stack" }, source.element, grid.element, text.element),
    show,
    read: () => ({ ...own.read(), ...grid.read() }),
    put: (/** @type {PlanDraft} */ draft) => {
      own.put(draft);
      grid.put(draft);
    },
  };
}

/** @param {Troubles} troubles */
function makeGrid(troubles) {
  const [columns, rows] = [
    numberField("Columns", { value: 9, min: 1, max: 101 }),
    numberField("Rows", { value: 9, min: 1, max: 101 }),
  ];
  const order = choiceField("Order", [
    ["serpentine", "serpentine"],
    ["rows", "each row from the left"],
  ]);
  const [x, y] = [
    numberField("Centre, right", { value: 0, step: "any", unit: "°" }),
    numberField("Centre, down", { value: 0, step: "any", unit: "°" }),
  ];
  const field = choiceField("Field", [
    ["all", "all that both eyes reach"],
    ["extent", "by its extent"],
    ["step", "by the step"],
    ["overlap", "by the overlap"],
  ]);
  const [across, down] = [
    numberField("Across", { step: "any", unit: "°" }),
    numberField("Down", { step: "any", unit: "°" }),
  ];
  const note = h("p", { class: "why" });
  let shown = "all";
  const show = () => {
    const chosen = /** @type {PlanDraft["field"]} */ (field.value());
    const { across: sideways, down: downwards, unit, usual, note: words } = EXTENTS[chosen];
    [across, down].forEach(({ element, input }, index) => {
      element.hidden = chosen === "all";
      setText(element.querySelector("label") ?? element, [sideways, downwards][index] ?? "");
      setText(element.querySelector(".unit") ?? element, unit);
      if (chosen !== shown) input.value = String(usual[index]);
    });
    shown = chosen;
    setText(note, words);
  };
  const element = h(
    "div",
    { class: "stack" },
    asked([columns.element, rows.element, order.element], troubles.place("size")),
    asked([field.element, h("div", { class: "fields" }, across.element, down.element)], note, troubles.place("field")),
    asked([x.element, y.element], troubles.place("centre")),
  );
  const fields = named({ columns, rows, order, centre_ax_deg: x, centre_ay_deg: y, field, across, down });
  return {
    element,
    show,
    read: fields.read,
    put: (/** @type {PlanDraft} */ draft) => {
      fields.put(draft);
      shown = draft.field; // the restored draft carries its numbers
    },
  };
}

/** @param {Troubles} troubles @param {() => string | null} asText @param {() => void} changed */
function makeText(troubles, asText, changed) {
  const input = h("textarea", {
    id: "set-points",
    rows: 9,
    spellcheck: "false",
    autocapitalize: "off",
    autocomplete: "off",
    wrap: "off",
  });
  input.value = "# right°, down°[, distance m][, shift°]\n-4, -3\n 4, -3\n-4,  3\n 4,  3\n@interpolate 5 5 zigzag\n";
  const begin = textButton("Begin with the grid", () => {
    input.value = asText() ?? input.value;
    changed();
  });
  const words = html`<dl class="meanings">
    ${LANGUAGE.flatMap(([word, what]) => [html`<dt><code>${word}</code></dt>`, html`<dd>${what}</dd>`])}
  </dl>`;
  const element = h(
    "div",
    { class: "stack asked-for" },
    html`<div class="field"><label for="set-points">Set points</label>${input}</div>`,
    troubles.place("text"),
    html`<div class="actions">${begin}</div>`,
    html`<details><summary>The language</summary>${words}</details>`,
  );
  const put = (/** @type {string} */ given) => {
    input.value = given;
  };
  return { element, value: () => input.value, put };
}
