// What the server says of plans of the ground, and what the page keeps of them. Types only: no browser loads this file.

import type { ProblemDocument } from "../types.js";

export type Place = [number, number];
export type Bound = "inflated" | "plain" | "as_printed";

export type RingDocument = {
  resolution_mrad: number;
  d_max_m: number;
  inner_m: number;
  outer_m: number;
  empty: boolean;
  empty_because: string | null;
  area_m2: number;
};

export type CurveDocument = { d_max_m: number[]; success: number[]; clear: number[] };

export type StandoffDocument = {
  ring: RingDocument;
  domain_m2: number;
  corridor_m2: number;
  clear_at_inner: number;
  clear_at_outer: number;
  success: number;
  success_slope_per_m: number;
  expected_area_m2: number;
  curve: CurveDocument;
};

/** GeoJSON, as far as the page reads it. */
export type Geometry = { type: string; coordinates?: unknown; geometries?: Geometry[] };
export type Feature = { type: "Feature"; geometry: Geometry | null; properties: Record<string, unknown> | null };
export type Geojson = { type: string; features?: Feature[] };

/** Outlines of a surface, holes among them: inside is where an odd number of them goes around. */
export type Outlines = Place[][];

export type MapDocument = {
  map: Geojson;
  bounds_m: number[];
  targets_m: number[][];
  obstacles: number;
  obstacle_m2: number;
  vertices: number;
};

export type RegionsDocument = {
  ring: RingDocument;
  areas: { multi_m2: number; single_m2: number; weighted_m2: number };
  regions: { target: number; x_m: number; y_m: number; area_m2: number; ring_share: number | null }[];
  empty_because: string | null;
  points: { x_m: number; y_m: number; targets: number[] }[];
  geojson: Geojson;
  duration_ms: number;
};

/** The newest answer; `stale` while a newer one is awaited. */
export type Answered<T> = { stale: boolean; document: T | null; problem: ProblemDocument | null };

export type NumberName =
  | "feature_mm" | "px_per_deg" | "pixels" | "d_min_m" | "near_error_m" | "occupancy" | "radius_m" | "agent_radius_m" | "domain_m2";

/** Numbers as they stand in their fields; NaN: not a number. */
export type PlanSettings = Record<NumberName, number> & { bound: Bound; own_domain: boolean };

export type MapKind = "random" | "open" | "geojson" | "picture";

/** How the map is made; what a user gave herself is in `given`. */
export type MapWish = {
  kind: MapKind;
  seed: number;
  size_m: number;
  obstacles: number;
  targets: number;
};

/** A user's own map, as the server took it. */
export type GivenMap = { name: string; document: MapDocument; picture: string | null };

export type PlannerPageState = {
  planner_page: boolean;
};
