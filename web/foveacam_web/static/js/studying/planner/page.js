// Builds the planner: finds on a map where the rig resolves a feature and stays unnoticed. Needs no rig.

import { nothing, panel, textButton } from "../../elements/parts.js";
import { segments, Troubles } from "../../capturing/capture/parts.js";
import { fill, h, html, setText, update } from "../../elements/dom.js";
import { hand } from "../../elements/download.js";
import { sentence } from "../../elements/format.js";
import { waiting } from "../../elements/waiting.js";
import { pageHead } from "../../pages.js";
import { Bench } from "./bench.js";
import { makeControls } from "./controls.js";
import { pngOf, svgText } from "./exports.js";
import { makeChances, makeRoom } from "./figures.js";
import { makeSource } from "./source.js";
import { makeTargets } from "./targets.js";
import { PlanView } from "./view.js";

/**
 * @import { MapPoint, Store } from "#console"
 */

/** @param {HTMLElement} place @param {{store: Store}} context */
export function mountPlannerPage(place, { store }) {
  const bench = new Bench(() => show());
  const troubles = new Troubles();
  const above = h("div", { class: "above" });
  const controls = makeControls({ troubles, changed: (part) => bench.set(part) });
  const source = makeSource({
    place: troubles.place("map"),
    changed: (part) => bench.setMap(part),
    give: (given) => bench.give(given),
  });
  const orders = targetOrders(bench);
  const targets = makeTargets(orders);
  const view = new PlanView(orders);
  const nowhere = h("p", { class: "nowhere", role: "status" });
  const [chances, room] = [makeChances(), makeRoom()];
  const show = () => {
    const { map, targets_m, standoff, regions, plan } = bench;
    controls.show(plan.settings);
    source.show(plan.map, bench.givenName);
    targets.show(targets_m, plan.targets_m === null || map?.targets_m.length === 0);
    chances.show(standoff);
    room.show(regions, map);
    setText(nowhere, regions.document?.empty_because ?? standoff.document?.ring.empty_because ?? "");
    const homeless = troubles.show(bench.troubles);
    fill(above, ...homeless.map((words) => html`<p class="refused" role="alert">${sentence(words)}</p>`));
    plans.classList.toggle("no-map", map === null);
    update(
      noMap,
      bench.drawing ? waiting("The map is computed") : nothing("No map yet: choose under “Map” where it comes from."),
    );
    const stale = regions.stale || regions.problem !== null;
    if (map)
      view.show({
        map,
        picture: bench.picture,
        targets_m,
        ring: ringOf(bench),
        regions: regions.document,
        stale,
        whole: bench.whole,
      });
  };
  const noMap = h("div", { class: "no-map-yet" });
  const plans = h(
    "div",
    { class: "column planner-plan" },
    noMap,
    panel("Plan", toolbar(bench, view), nowhere, view.element),
    panel("Targets", targets.element, troubles.place("targets")),
  );
  fill(
    place,
    pageHead(
      "planner-title",
      "Where to stand",
      html`<p class="lead">Near enough to resolve a feature, too far to be noticed. Needs no rig.</p>`,
    ),
    above,
    html`<div class="planner-body">
      ${controls.element}
      ${plans}
      <div class="column planner-figures">
        ${panel("Map", source.element)}
        ${panel("Room on the map", room.element)}
        ${panel("Ring and chances", chances.element)}
      </div>
    </div>`,
  );
  window.addEventListener("hashchange", () => bench.open());
  store.on(["stream"], ({ stream }) => stream === "open" && bench.reconnected());
  store.on(["planner_page"], ({ planner_page }) => planner_page && bench.open());
}

/** Return the newest ring of the server's answers. @param {Bench} bench */
function ringOf({ standoff, regions }) {
  const [first, second] = standoff.problem === null ? [standoff, regions] : [regions, standoff];
  return first.document?.ring ?? second.document?.ring ?? null;
}

/** Return the functions that add, move and remove targets. @param {Bench} bench */
function targetOrders(bench) {
  const middle = () => {
    const [x0 = 0, y0 = 0, x1 = 0, y1 = 0] = bench.map?.bounds_m ?? [];
    return /** @type {MapPoint} */ ([(x0 + x1) / 2, (y0 + y1) / 2]);
  };
  const add = (/** @type {MapPoint} */ place = middle()) => bench.setTargets([...bench.targets_m, place]);
  return {
    add,
    move: (/** @type {number} */ index, /** @type {MapPoint} */ place) =>
      bench.setTargets(bench.targets_m.map((each, other) => (other === index ? place : each))),
    remove: (/** @type {number} */ index) => bench.setTargets(bench.targets_m.filter((_, other) => other !== index)),
    reset: () => bench.setTargets(null),
  };
}

/** Build the drawing of the plan and its export buttons. @param {Bench} bench @param {PlanView} view */
function toolbar(bench, view) {
  const seen = segments("What is seen", [
    ["map", "Map"],
    ["rings", "Rings whole"],
  ]);
  seen.element.addEventListener("change", () => bench.seeWhole(seen.value() === "rings"));
  const button = (/** @type {string} */ text, /** @type {() => unknown} */ act) =>
    textButton(text, () => act(), { picture: "down", name: `Save the plan as ${text}` });
  const geojson = () => bench.regions.document?.geojson ?? bench.map?.map;
  return html`<div class="plan-tools">
    ${seen.element}
    <span class="actions">
      ${button("PNG", async () => hand(await pngOf(view.drawing), "plan.png"))}
      ${button("SVG", () => hand(new Blob([svgText(view.drawing)], { type: "image/svg+xml" }), "plan.svg"))}
      ${button("GeoJSON", () =>
        hand(new Blob([JSON.stringify(geojson(), null, 1)], { type: "application/geo+json" }), "plan.geojson"),
      )}
    </span>
  </div>`;
}
