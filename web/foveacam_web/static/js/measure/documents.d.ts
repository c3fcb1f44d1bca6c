// What the server says of measurements, and what the page keeps of measuring. Types only.

import type { Point, ViewName } from "../types.js";

export type MeasureKind = "point" | "length" | "plane" | "profile";
export type MeasuredView = "wide" | "left" | "right" | "anaglyph" | "difference" | "depth";
export type Place = { view: MeasuredView; x_px: number; y_px: number; fixation_id?: string };
export type Triple = [number, number, number];

export type MeasuredPoint = {
  view: MeasuredView;
  x_px: number;
  y_px: number;
  snapped_px: number;
  at_edge: boolean;
  fixation_id: string;
  point_rig_m: Triple;
  point_sigma_m: Triple;
  distance_m: number;
  distance_sigma_m: number;
};

export type MeasuredLength = {
  length_m: number;
  length_sigma_m: number;
  delta_rig_m: Triple;
  delta_sigma_m: Triple;
  same_look: boolean;
};

export type MeasuredPlane = {
  normal: Triple;
  normal_sigma_deg: number;
  pan_deg: number;
  pan_sigma_deg: number;
  tilt_deg: number;
  tilt_sigma_deg: number;
  distance_m: number;
  distance_sigma_m: number;
  residual_rms_m: number;
  expected_rms_m: number;
  flatness_m: number;
  pixels: number;
  outliers: number;
  outlier_fraction: number;
};

export type ProfileSample = { along_m: number; z_m: number | null; z_sigma_m: number | null };
export type MeasuredProfile = {
  samples: ProfileSample[];
  median_z_m: number;
  shared_sigma_m: number;
  known_fraction: number;
};

export type MeasurementDocument = {
  id: string;
  kind: MeasureKind;
  label: string;
  created_utc: string;
  fixation_ids: string[];
  points: MeasuredPoint[];
  length: MeasuredLength | null;
  plane: MeasuredPlane | null;
  profile: MeasuredProfile | null;
  drawn_px: Partial<Record<ViewName, [number, number][]>>;
  gaze: { left_v: [number, number]; right_v: [number, number] } | null;
};

/** `start`: the first end of a length that waits for its second. `view`: where the tool's bar stands. */
export type Measuring = { kind: MeasureKind; view: MeasuredView; start: Place | null; busy: boolean };

export type MeasureState = {
  measurements: MeasurementDocument[] | null;
  hidden_measurements: string[];
  selected_measurement: string | null;
  measuring: Measuring | null;
};

/** What a drag over a view draws while it lasts, picture px. */
export type Draft = { kind: MeasureKind; from: Point; to: Point };
