// Defines the numbers of a plan: labels, ranges, defaults; writes a plan to the page's address and reads it from there.
// Pure functions.

/**
 * @import { MapKind, MapPoint, MapSettings, PlanSettings, PlannerNumber, RingBound } from "#page"
 * @import { ScaleKind } from "../../devices/rig/scale.js"
 * @typedef {{
 *   label: string, unit: string, low: number, high: number, kind: ScaleKind, value: number,
 *   presets?: {text: string, value: number}[]
 * }} NumberSetting `low`, `high`: the slider's ends; more can be typed in
 * @typedef {{settings: PlanSettings, map: MapSettings, targets_m: MapPoint[] | null}} Plan `targets_m`: null: the map's own
 */

/** @type {Readonly<Record<PlannerNumber, NumberSetting>>} */
export const NUMBERS = Object.freeze({
  feature_mm: { label: "Feature size S", unit: "mm", low: 1, high: 1000, kind: "log", value: 20 },
  px_per_deg: {
    label: "Resolution",
    unit: "px/°",
    low: 5,
    high: 2000,
    kind: "log",
    value: 502,
    presets: [
      { text: "fovea 502", value: 502 },
      { text: "wide 55", value: 55 },
    ],
  },
  pixels: { label: "Pixels on the feature", unit: "px", low: 1, high: 500, kind: "log", value: 40 },
  d_min_m: { label: "Noticed nearer than D_min", unit: "m", low: 0, high: 40, kind: "linear", value: 8 },
  near_error_m: { label: "Depth error ΔZ near", unit: "m", low: 0, high: 5, kind: "linear", value: 0.2 },
  occupancy: { label: "Obstacle density p", unit: "per m²", low: 0, high: 0.2, kind: "linear", value: 0.02 },
  radius_m: { label: "Obstacle radius", unit: "m", low: 0, high: 3, kind: "linear", value: 0.5 },
  domain_m2: { label: "Domain", unit: "m²", low: 100, high: 1e6, kind: "log", value: 10_000 },
  agent_radius_m: { label: "Agent radius", unit: "m", low: 0, high: 3, kind: "linear", value: 0.3 },
});

/** @type {readonly PlannerNumber[]} */
export const NAMES = Object.freeze(/** @type {PlannerNumber[]} */ (Object.keys(NUMBERS)));

/** @type {readonly [RingBound, string][]} */
export const BOUNDS = Object.freeze(
  /** @type {[RingBound, string][]} */ ([
    ["inflated", "added"],
    ["plain", "left out"],
    ["as_printed", "subtracted"],
  ]),
);

/** @type {Readonly<MapSettings>} */
const FIRST_MAP = Object.freeze({ kind: "random", seed: 1, size_m: 60, obstacles: 40, targets: 5 });
/** @type {readonly MapKind[]} */
const KINDS = ["random", "open", "geojson", "picture"];

/** @returns {Plan} */
function firstPlan() {
  const numbers = /** @type {Record<PlannerNumber, number>} */ (
    Object.fromEntries(NAMES.map((name) => [name, NUMBERS[name].value]))
  );
  return { settings: { ...numbers, bound: "inflated", own_domain: true }, map: { ...FIRST_MAP }, targets_m: null };
}

/** Write what differs from the default plan as an address query. @param {Plan} plan */
export function written({ settings, map, targets_m }) {
  const first = firstPlan();
  const words = new URLSearchParams();
  for (const name of NAMES)
    if (settings[name] !== first.settings[name] && Number.isFinite(settings[name]))
      words.set(name, String(settings[name]));
  if (settings.bound !== first.settings.bound) words.set("bound", settings.bound);
  if (!settings.own_domain) words.set("domain_m2", "ring");
  if (map.kind !== first.map.kind) words.set("map", map.kind);
  for (const name of /** @type {const} */ (["seed", "size_m", "obstacles", "targets"])) {
    if (map[name] !== first.map[name] && Number.isFinite(map[name])) words.set(name, String(map[name]));
  }
  if (targets_m)
    words.set("at", targets_m.map((place) => place.map((value) => Number(value.toFixed(3))).join(",")).join(";"));
  return words.toString().replaceAll("%2C", ",").replaceAll("%3B", ";");
}

/**
 * Read a plan from an address query; missing and invalid values take their defaults.
 * @param {string} text
 * @returns {Plan}
 */
export function readPlan(text) {
  const words = new URLSearchParams(text);
  const plan = firstPlan();
  const take = (/** @type {string} */ name, /** @type {(value: number) => void} */ put) => {
    const word = words.get(name);
    if (word !== null && word.trim() !== "" && Number.isFinite(Number(word))) put(Number(word));
  };
  for (const name of NAMES) take(name, (value) => (plan.settings[name] = value));
  for (const name of /** @type {const} */ (["seed", "size_m", "obstacles", "targets"]))
    take(name, (value) => (plan.map[name] = value));
  plan.settings.own_domain = words.get("domain_m2") !== "ring";
  plan.settings.bound = BOUNDS.find(([bound]) => bound === words.get("bound"))?.[0] ?? plan.settings.bound;
  plan.map.kind = KINDS.find((kind) => kind === words.get("map")) ?? plan.map.kind;
  plan.targets_m = placesOf(words.get("at"));
  return plan;
}

/** @param {string | null} text @returns {MapPoint[] | null} */
function placesOf(text) {
  if (text === null) return null;
  const places = text
    .split(";")
    .filter(Boolean)
    .map((place) => place.split(",").map(Number));
  return places.every((place) => place.length === 2 && place.every(Number.isFinite))
    ? /** @type {MapPoint[]} */ (places)
    : null;
}
