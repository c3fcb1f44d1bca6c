// Holds the plan: settings, map, targets, and the server's newest answers about them.

import { PLANNER_ADDRESS, planAt } from "../../addresses.js";
import { outcome, request } from "../../transport/api.js";
import { blamed, unfilled } from "./blame.js";
import { keepMap, keepPlan, keptMap, keptPlan } from "./kept.js";
import { Newest } from "./newest.js";
import { NAMES, readPlan, written } from "./settings.js";

/**
 * @import { MapDocument, RegionsDocument, StandoffDocument } from "#api"
 * @import { GivenMap, MapPoint, MapSettings, PlanSettings } from "#page"
 * @import { Given } from "./source.js"
 */

const RING = /** @type {const} */ (["feature_mm", "px_per_deg", "pixels", "d_min_m", "near_error_m"]);
const PATIENCE_MS = 60_000;
const REST_MS = 300;

/** The plan of the page. */
export class Bench {
  plan = readPlan("");
  whole = false;
  /** @type {GivenMap | null} */
  #given = null;
  #onChange;
  #open = false;
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  #timer;
  /** @type {Newest<MapDocument>} */
  #drawn;
  /** @type {Newest<StandoffDocument>} */
  #standoff;
  /** @type {Newest<RegionsDocument>} */
  #regions;

  /** @param {() => void} onChange called at each change */
  constructor(onChange) {
    this.#onChange = onChange;
    this.#drawn = new Newest("/planner/map", () => this.#again());
    this.#standoff = new Newest("/planner/standoff", onChange);
    this.#regions = new Newest("/planner/regions", onChange);
  }

  get standoff() {
    return this.#standoff.answer;
  }

  get regions() {
    return this.#regions.answer;
  }

  /** @returns {MapDocument | null} */
  get map() {
    return this.#own ? (this.#mine?.document ?? null) : this.#drawn.answer.document;
  }

  /** Whether the server computes a map, and none is shown meanwhile. */
  get drawing() {
    return !this.#own && this.#drawn.answer.stale && this.map === null;
  }

  get picture() {
    return this.#mine?.picture ?? null;
  }

  get givenName() {
    return this.#mine?.name ?? "";
  }

  /** @returns {MapPoint[]} */
  get targets_m() {
    return this.plan.targets_m ?? /** @type {MapPoint[]} */ (this.map?.targets_m ?? []);
  }

  get #own() {
    return this.plan.map.kind === "geojson" || this.plan.map.kind === "picture";
  }

  /** The user's own map, while its kind of map is selected. */
  get #mine() {
    const kind = this.#given?.picture ? "picture" : "geojson";
    return this.plan.map.kind === kind ? this.#given : null;
  }

  /** The current faults, each with its field on the page. */
  get troubles() {
    const empty = unfilled(this.plan.settings);
    const asked =
      empty.length > 0
        ? []
        : [this.standoff.problem, this.regions.problem].filter((problem) => problem?.status !== 0).flatMap(blamed);
    const map = this.#own ? null : this.#drawn.answer.problem;
    const found = [...empty, ...asked, ...blamed(map).map(({ words }) => ({ place: "map", words }))];
    const lost =
      this.#own && !this.#mine
        ? [
            {
              place: "map",
              words: `No ${this.plan.map.kind === "picture" ? "picture" : "map"} of your own is in this browser: load a file, or choose a random map`,
            },
          ]
        : [];
    return [...new Map([...found, ...lost].map((each) => [`${each.place} ${each.words}`, each])).values()];
  }

  /** Read the plan from the address when the page opens or its address changes. */
  open() {
    const given = planAt(location.hash);
    if (given === null) return;
    if (!this.#open) this.#given = keptMap();
    if (given !== "") this.plan = readPlan(given);
    else if (!this.#open) this.plan = readPlan(keptPlan());
    this.#open = true;
    this.#again();
  }

  /** Repeat the requests that did not reach the server. */
  reconnected() {
    for (const each of [this.#drawn, this.#standoff, this.#regions]) each.again();
  }

  /** @param {Partial<PlanSettings>} part */
  set(part) {
    this.plan.settings = { ...this.plan.settings, ...part };
    this.#again();
  }

  /** @param {Partial<MapSettings>} part */
  setMap(part) {
    this.plan.map = { ...this.plan.map, ...part };
    this.plan.targets_m = null;
    this.#again();
  }

  /** @param {MapPoint[] | null} targets_m null: those of the map */
  setTargets(targets_m) {
    this.plan.targets_m = targets_m;
    this.#again();
  }

  /** @param {boolean} whole */
  seeWhole(whole) {
    this.whole = whole;
    this.#onChange();
  }

  /**
   * Load a map of the user's own.
   * @param {Given} given
   * @returns {Promise<string | null>} the reason when it was refused
   */
  async give({ body, name, picture, kind }) {
    const options = { body, patience_ms: PATIENCE_MS };
    const asked = /** @type {Promise<MapDocument>} */ (request("POST", "/planner/map", options));
    const { answer, error } = await outcome(asked);
    if (error) return error.message;
    this.#given = { document: answer, name, picture };
    keepMap(this.#given);
    this.setMap({ kind });
    return null;
  }

  #again() {
    if (!this.#open) return;
    this.#noteSoon();
    this.#ask();
    this.#onChange();
  }

  /**
   * Write the plan to the address and to the browser's storage after a pause: browsers limit changes of the address.
   */
  #noteSoon() {
    clearTimeout(this.#timer);
    this.#timer = setTimeout(() => {
      const words = written(this.plan);
      const address = words ? `${PLANNER_ADDRESS}?${words}` : PLANNER_ADDRESS;
      // without a new entry in the history
      if (planAt(location.hash) !== null && location.hash !== address) history.replaceState(null, "", address);
      keepPlan(words);
    }, REST_MS);
  }

  #ask() {
    const { settings, map } = this.plan;
    const numbers = [map.seed, map.size_m, map.obstacles, map.targets];
    if (map.kind === "open" && Number.isFinite(map.size_m)) this.#drawn.want({ kind: "open", size_m: map.size_m });
    else if (map.kind === "random" && numbers.every(Number.isFinite)) this.#drawn.want({ ...map });
    if (NAMES.some((name) => !Number.isFinite(settings[name]) && (name !== "domain_m2" || settings.own_domain))) return;
    const ring = { ...Object.fromEntries(RING.map((name) => [name, settings[name]])), bound: settings.bound };
    const clutter = { occupancy: settings.occupancy, radius_m: settings.radius_m };
    this.#standoff.want({ ring, clutter, domain_m2: settings.own_domain ? settings.domain_m2 : null });
    const ground = this.map;
    const asked = ground && this.targets_m.length > 0;
    this.#regions.want(
      asked ? { map: ground.map, targets_m: this.targets_m, ring, agent_radius_m: settings.agent_radius_m } : null,
    );
  }
}
