// Step 2, the sweep: the rig turns so that the markers pass through the whole field; each eye centres its own marker.

import { changing, h, html } from "../../../elements/dom.js";
import { number } from "../../../elements/format.js";
import { NodeGrid } from "./nodegrid.js";
import { allHold, choiceField, nothing, numberField, panel, starter, tickField } from "../../../elements/parts.js";
import { isRunning } from "../state.js";

/**
 * @import { SweepDocument } from "#api"
 * @import { ConsoleState } from "#page"
 * @import { WizardContext } from "../page.js"
 */

/** @param {WizardContext} context */
export function makeMirrorsStep(context) {
  const { store } = context;
  const live = h("div", { class: "live-slot" });
  const grid = new NodeGrid();
  const stations = h("div", { class: "station-choice", role: "group", "aria-label": "Station" });
  const chosen = new ChosenStation();
  const empty = h("div", {});
  const showStations = changing(stations, (/** @type {Place[]} */ places) =>
    places.map((place) => stationButton(place, () => choose(place.name))),
  );
  const showEmpty = changing(empty, (/** @type {string} */ text) => (text ? [nothing(text)] : []));
  const update = () => {
    const places = placesOf(store.state);
    chosen.follow(places, store.state);
    showStations(places.map((place) => ({ ...place, chosen: place.name === chosen.name })));
    const sweep = store.state.session?.sweeps.find((each) => each.station === chosen.name) ?? null;
    grid.update(sweep);
    grid.element.hidden = !sweep?.poses.length;
    showEmpty(
      sweep?.poses.length
        ? ""
        : places.length
          ? "Nothing measured at this station yet."
          : "No station with markers is set up. Name one in the rig's file: where to point, and how far away the markers are.",
    );
  };
  const choose = (/** @type {string} */ name) => {
    chosen.pick(name);
    update();
  };
  store.on(["session", "pan_tilt", "work"], update);
  const element = h(
    "div",
    { class: "step step-mirrors" },
    html`<div class="seeing">
      <div class="stack">
        ${panel(
          "Measure",
          runForm(context, () => chosen.name),
        )}
        ${panel("Sweep", stations, empty, grid.element)}
      </div>
      ${live}
    </div>`,
  );
  return { element, live };
}

/** @typedef {{name: string, distance_m: number | null, done: number, nodes: number, refused: number, chosen: boolean}} Place */

/** Return the station whose grid is shown: the selected one, else the one that is being swept. */
class ChosenStation {
  name = "";
  #picked_in = "";
  #job = "";
  #session = "";
  /** @type {Map<string, number>} */
  #done = new Map();

  /** @param {string} name */
  pick(name) {
    this.name = name;
    this.#picked_in = this.#job;
  }

  /** @param {Place[]} places @param {ConsoleState} state */
  follow(places, { work, session }) {
    this.#job = `${session?.id} ${work?.job_id}`;
    const known = this.#session === (session?.id ?? "");
    const growing = known ? places.find(({ name, done }) => done > (this.#done.get(name) ?? 0)) : undefined;
    this.#session = session?.id ?? "";
    this.#done = new Map(places.map(({ name, done }) => [name, done]));
    if (growing && isRunning(work) && this.#picked_in !== this.#job) this.name = growing.name;
    if (!places.some(({ name }) => name === this.name)) this.name = places[0]?.name ?? "";
  }
}

/**
 * Return the stations with markers, those set up now and those of stored sweeps.
 * @param {ConsoleState} state
 * @returns {Place[]}
 */
function placesOf({ session, pan_tilt }) {
  const sweeps = session?.sweeps ?? [];
  const known = (pan_tilt?.stations ?? []).filter(({ target }) => target === "markers");
  const names = [...new Set([...known.map(({ name }) => name), ...sweeps.map(({ station }) => station)])];
  return names.map((name) => {
    const sweep = sweeps.find((each) => each.station === name);
    return {
      name,
      distance_m: sweep?.distance_m ?? known.find((each) => each.name === name)?.distance_m ?? null,
      done: sweep?.done ?? 0,
      nodes: sweep?.nodes ?? 0,
      refused: refusals(sweep),
      chosen: false,
    };
  });
}

/** @param {SweepDocument | undefined} sweep */
function refusals(sweep) {
  return (sweep?.poses ?? []).filter(({ left, right }) => left === "refused" || right === "refused").length;
}

/** @param {Place} place @param {() => void} choose */
function stationButton({ name, distance_m, done, nodes, refused, chosen }, choose) {
  const far = distance_m === null ? "distance not measured" : `${number(distance_m, 2)} m`;
  const measured = nodes ? `${done} of ${nodes}${refused ? `, ${refused} with a refusal` : ""}` : "not measured";
  return html`<button type="button" class="station" aria-pressed=${String(chosen)} @click=${choose}>
    <strong>${name}</strong>
    <span>${far}</span>
    <span class="number">${measured}</span>
  </button>`;
}

/** @param {WizardContext} context @param {() => string} station the selected one */
function runForm({ store, orders }, station) {
  const where = choiceField("Measure at", [
    ["", "every station with markers"],
    ["one", "the chosen station"],
  ]);
  const across = numberField("Nodes across", { min: 3, max: 41, hint: "9" });
  const down = numberField("Nodes down", { min: 3, max: 41, hint: "9" });
  const ax = numberField("Across up to ±", { min: 0.5, max: 12, step: "any", unit: "°", hint: "as the rig" });
  const ay = numberField("Down up to ±", { min: 0.5, max: 12, step: "any", unit: "°", hint: "as the rig" });
  const spacing = choiceField("Spacing", [
    ["", "as usual"],
    ["rim", "denser near the rim"],
    ["even", "even"],
  ]);
  const again = tickField("Start over: forget what was measured", false);
  const act = () => {
    if (!allHold(across, down, ax, ay)) return undefined;
    const [columns, rows] = [across.value(), down.value()];
    return orders.run("mirrors", {
      stations: where.value() === "one" && station() ? [station()] : null,
      nodes: columns === null && rows === null ? null : [columns ?? rows, rows ?? columns],
      extent_ax_deg: ax.value(),
      extent_ay_deg: ay.value(),
      spacing: spacing.value() || null,
      restart: again.value() || null,
    });
  };
  const start = starter({
    label: "Measure",
    store,
    act,
    primary: true,
    keys: ["session", "pan_tilt"],
    why: against,
    named: startWords,
  });
  return html`<form class="run" @submit=${(/** @type {Event} */ event) => event.preventDefault()}>
    <p class="lead">
      The rig turns from node to node. At each one the wide camera measures where the markers are, and each eye steers
      until its own marker is in the middle.
    </p>
    <details class="options">
      <summary>Grid and options</summary>
      <div class="fields">${[where, across, down, ax, ay, spacing, again].map(({ element }) => element)}</div>
    </details>
    <p class="actions">${start}</p>
  </form>`;
}

/** @param {ConsoleState} state */
function against({ session, pan_tilt }) {
  if (!session?.wide?.fit) return "First step 1: without the wide lens no marker's direction is known.";
  if (pan_tilt && !pan_tilt.present) return "This rig has no pan-tilt; see on the right how to set one up.";
  if (pan_tilt?.fault) return "The pan-tilt is not usable now.";
  return null;
}

/** @param {ConsoleState} state */
function startWords({ session }) {
  const begun = session?.sweeps.filter(({ done }) => done > 0) ?? [];
  if (begun.length === 0) return "Measure";
  return begun.some(({ done, nodes }) => done < nodes) ? "Go on measuring" : "Measure what is missing";
}

/** @param {ConsoleState} state */
export function mirrorsProgress({ session }) {
  const sweeps = session?.sweeps ?? [];
  const done = sweeps.reduce((sum, each) => sum + each.done, 0);
  const nodes = sweeps.reduce((sum, each) => sum + each.nodes, 0);
  if (nodes === 0) return null;
  return { tone: done >= nodes ? "good" : "plain", text: `${done}/${nodes}` };
}
