// Builds the plan's editor: points, distance, exposures and stacks at each point, rail positions. Reports each change.

import { choiceField, numberField, tickField } from "../../elements/parts.js";
import { h, html } from "../../elements/dom.js";
import { asked, named, numberChips, segments } from "./parts.js";
import { asSetPoints, PAPER_RAIL_MM, planOf } from "./plan.js";
import { makePoints } from "./points.js";

/**
 * @import { GridPoints } from "#api"
 * @import { PlanDraft, Store } from "#console"
 * @import { Troubles } from "./parts.js"
 */

/** @param {{store: Store, troubles: Troubles, changed: () => void}} context */
export function makeEditor({ store, troubles, changed }) {
  /** @type {() => PlanDraft} */
  const read = () => Object.assign({}, ...parts.map((part) => part.read()));
  const parts = [
    makePoints(troubles, gridText(store, read), () => edited()),
    makeDistance(troubles),
    makeExposures(troubles, () => edited()),
    makeRail(troubles, () => edited()),
  ];
  const titles = ["Points", "Distance", "At every point", "Rail"];
  const edited = () => {
    for (const { show } of parts) show();
    changed();
  };
  const element = h(
    "div",
    { class: "plan-editor", on: { input: edited, change: edited } },
    parts.map(
      (part, index) => html`<fieldset class="group"><legend>${titles[index]}</legend>${part.element}</fieldset>`,
    ),
  );
  const put = (/** @type {PlanDraft} */ draft) => {
    for (const part of parts) part.put(draft);
    for (const part of parts) part.show();
  };
  return { element, read, put };
}

/**
 * Return a function that writes the grid in the set-point language; null while the reach of the eyes is unknown.
 * @param {Store} store
 * @param {() => PlanDraft} read
 * @returns {() => string | null}
 */
function gridText(store, read) {
  /** The extent of the last estimated grid. @type {Pick<GridPoints, "half_width_deg" | "half_height_deg"> | null} */
  let reach = null;
  store.on(["estimate"], ({ estimate: { document } }) => {
    const grid = document?.plan.points;
    if (grid?.kind === "grid") reach = { half_width_deg: grid.half_width_deg, half_height_deg: grid.half_height_deg };
  });
  return () => {
    const draft = read();
    const { points } = planOf(
      { ...draft, source: "grid", field: draft.field === "overlap" ? "all" : draft.field },
      null,
    ).plan;
    if (points.kind !== "grid" || (points.half_width_deg === null && reach === null)) return null;
    return asSetPoints(points.half_width_deg === null ? { ...points, ...reach } : points);
  };
}

/** @param {Troubles} troubles */
function makeDistance(troubles) {
  const mode = segments(
    "Where the eyes meet",
    /** @type {[PlanDraft["mode"], string][]} */ ([
      ["scene", "Measured"],
      ["given", "Given"],
      ["parallel", "Parallel"],
    ]),
  );
  const given = numberField("Distance", { value: 4, step: "any", min: 0, unit: "m" });
  const assumed = numberField("Estimate as if at", { step: "any", min: 0, unit: "m", hint: "seen last" });
  const each = tickField("Verge again at every point", false);
  const note = h("p", { class: "why", text: "The average of nine directions, as known or as measured before." });
  const show = () => {
    given.element.hidden = mode.value() !== "given";
    assumed.element.hidden = note.hidden = mode.value() !== "scene";
  };
  show();
  const element = h(
    "div",
    { class: "stack" },
    mode.element,
    asked([given.element, assumed.element], note, troubles.place("distance")),
    each.element,
  );
  return { element, show, ...named({ mode, distance_m: given, assumed_m: assumed, each_point: each }) };
}

/** @param {Troubles} troubles @param {() => void} changed */
function makeExposures(troubles, changed) {
  const bracket = numberChips({
    label: "Exposures",
    unit: "ms",
    empty: "as the cameras are set",
    lists: [
      { text: "Bracket: 2, 8 and 32 ms", values: [2, 8, 32] },
      { text: "None", values: [] },
    ],
    changed,
  });
  const frames = numberField("Frames of each", { value: 1, min: 1, max: 256 });
  const keep = choiceField("Kept of a stack", [
    ["mean", "the mean, 16 bits"],
    ["all", "every frame"],
  ]);
  const wide = choiceField("Wide pictures", [
    ["point", "with every point"],
    ["scan", "one a scan"],
    ["none", "none"],
  ]);
  const show = () => {
    keep.element.hidden = (frames.value() ?? 1) <= 1;
  };
  show();
  const element = h(
    "div",
    { class: "stack" },
    asked([bracket.element], troubles.place("exposures")),
    asked([frames.element, keep.element, wide.element], troubles.place("stack")),
  );
  return { element, show, ...named({ exposures_ms: bracket, stack_frames: frames, stack_keep: keep, wide }) };
}

/** @param {Troubles} troubles @param {() => void} changed */
function makeRail(troubles, changed) {
  const places = numberChips({
    label: "Places",
    unit: "mm",
    empty: "where the rig stands",
    lists: [
      { text: "The five places of the paper", values: PAPER_RAIL_MM },
      { text: "None", values: [] },
    ],
    changed,
  });
  const note = h("p", { class: "why", text: "A full scan from each, in this order." });
  return {
    element: h("div", { class: "stack" }, asked([places.element], note, troubles.place("rail"))),
    show: () => {},
    ...named({ rail_positions_mm: places }),
  };
}
