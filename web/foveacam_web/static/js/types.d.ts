// The documents that the server speaks and the state that the page keeps. Types only: no browser loads this file.
// Those of calibrating are in calibration/documents.d.ts, those of the rig's devices in rig/documents.d.ts.

import type { CalibrationState } from "./calibration/documents.js";
import type { CapturePageState } from "./capture/documents.js";
import type { GalleryState } from "./gallery/documents.js";
import type { RecordingState } from "./gallery/recording_documents.js";
import type { MeasureState } from "./measure/documents.js";
import type { PlannerPageState } from "./planner/documents.js";
import type { CameraDocument, ControllerLink, DeviceInfo, Difference, RigPageState, TriggerDocument } from "./rig/documents.js";

export type { CameraDocument } from "./rig/documents.js";

export type Role = "wide" | "left" | "right";
export type AnnotatedName = "calibration_wide" | "calibration_left" | "calibration_right";
export type ViewName = Role | "anaglyph" | "difference" | "depth" | "wide_depth" | AnnotatedName;
export type Point = { x: number; y: number };
export type Direction = { ax_deg: number; ay_deg: number };
export type PixelRequest = { pixel: { x_px: number; y_px: number } };
export type RectangleRequest = { rectangle: { x_px: number; y_px: number; width_px: number; height_px: number } };
export type DirectionRequest = { direction: Direction };
export type Within = { nearest_m: number; farthest_m: number | null };
export type FixationRequest = (PixelRequest | RectangleRequest | DirectionRequest) & {
  label?: string;
  depth?: boolean;
  within?: Within;
  corrects?: string;
};

export type ProblemDocument = {
  type: string;
  title: string;
  status: number;
  detail: string;
  instance?: string;
  asked?: unknown;
  found?: unknown;
  remedy?: string;
};

export type EyePose = { x_v: number | null; y_v: number | null; ax_deg: number | null; ay_deg: number | null };

export type MirrorsDocument = {
  connected: boolean;
  enabled: boolean | null;
  left: EyePose | null;
  right: EyePose | null;
  fault: string | null;
  rtt_p50_ms: number | null;
  rtt_p99_ms: number | null;
  tx_packets: number;
  rx_packets: number;
  bad_packets: number;
  clock_offset_ms: number | null;
  guarded?: boolean;
  rail_wanted?: boolean;
  controller?: DeviceInfo | null;
  link?: ControllerLink | null;
};

export type Steering = { ax_min_deg: number; ax_max_deg: number; ay_min_deg: number; ay_max_deg: number };

export type RigProblem = { device: string; detail: string; remedy?: string };

export type RigDocument = {
  name: string;
  rig_id: string | null;
  simulated: boolean;
  scene: string | null;
  state: "opening" | "ready" | "degraded" | "stopped";
  problems: RigProblem[];
  baseline_m: number | null;
  steering: Steering | null;
  cameras: CameraDocument[];
  divergence?: Difference[];
  mirrors: MirrorsDocument | null;
  trigger?: TriggerDocument | null;
  calibration: {
    id: string;
    label: string;
    origin: string;
    created_utc: string;
    age_s: number;
    mirror_sigma_deg: number | null;
    rectify_sigma_px: number | null;
    wide: Intrinsics;
  } | null;
  calibration_problem: string | null;
  clock: { t_ns: number; utc: string };
};

/** The wide lens: OpenCV's pinhole with k1 k2 p1 p2 k3. */
export type Intrinsics = {
  width: number;
  height: number;
  fx_px: number;
  fy_px: number;
  cx_px: number;
  cy_px: number;
  distortion: number[];
};

export type VergeStep = {
  index: number;
  phase: string;
  left_ax_deg: number;
  left_ay_deg: number;
  right_ax_deg: number;
  right_ay_deg: number;
  residual_x_px: number | null;
  residual_y_px: number | null;
  score: number | null;
  compute_ms: number | null;
};

export type FixationState = "verged" | "no_texture" | "lost" | "out_of_range" | "timed_out";

export type Basis = "both_foveae" | "fovea_and_wide" | "surroundings" | "bound";

export type Bound = { nearest_m: number; farthest_m: number | null };

export type Alternative = {
  basis: Basis;
  distance_m: number;
  distance_sigma_m: number;
  point_rig_m: [number, number, number];
  probability: number;
};

export type EyeView = { sees_target: boolean; reason: string };

export type FixationDocument = {
  id: string;
  job_id: string;
  created_utc: string;
  request: FixationRequest;
  target: { ax_deg: number; ay_deg: number; x_px: number | null; y_px: number | null };
  state: FixationState;
  reason: string;
  distance_m: number | null;
  distance_sigma_m: number | null;
  point_rig_m: [number, number, number] | null;
  basis: Basis | null;
  bound: Bound | null;
  alternatives: Alternative[];
  chosen_alternative?: number | null;
  left_view: EyeView | null;
  right_view: EyeView | null;
  residual_px: number | null;
  score: number | null;
  duration_ms: number | null;
  steps: VergeStep[];
  calibration_id: string;
  target_id: string | null;
  cloud_id: string | null;
};

export type Correction = {
  kind: "choice" | "nearer" | "farther" | "rectangle" | "click";
  created_utc: string;
  fixation_id: string;
  alternative: number | null;
};

/** Where each eye can look: corners in wide px, at `distance_m`, null for far away. */
export type ReachDocument = {
  calibration_id: string;
  distance_m: number | null;
  left_px: [number, number][];
  right_px: [number, number][];
};

export type Suggestion = { x_px: number; y_px: number; ax_deg: number; ay_deg: number; score: number };

export type TargetDocument = {
  id: string;
  label: string;
  fixation_id: string;
  distance_m: number | null;
  distance_sigma_m: number | null;
  point_rig_m: [number, number, number] | null;
  basis: Basis;
  bound?: Bound | null;
  alternatives: Alternative[];
  left_view?: EyeView | null;
  right_view?: EyeView | null;
  corrections?: Correction[];
  ax_deg: number;
  ay_deg: number;
  x_px: number | null;
  y_px: number | null;
  cloud_id: string | null;
  created_utc: string;
};

export type CloudDocument = {
  id: string;
  fixation_id: string;
  points: number;
  created_utc: string;
  centre_rig_m: [number, number, number];
  z_min_m: number;
  z_max_m: number;
  sigma_median_m: number;
  ply_url: string;
  glb_url: string | null;
  depth_url: string;
};

export type JobState = "queued" | "running" | "cancelling" | "cancelled" | "failed" | "succeeded";

export type JobDocument = {
  id: string;
  kind: string;
  state: JobState;
  created_utc: string;
  started_utc: string | null;
  ended_utc: string | null;
  progress: { done: number; total: number | null; eta_s: number | null; note: string | null } | null;
  result_url: string | null;
  problem: ProblemDocument | null;
};

export type WideDepthDocument = {
  columns: number;
  rows: number;
  cell_px: number;
  known_cells: number;
  known_fraction: number;
  sources: Record<string, number>;
  nearest_m: number | null;
  farthest_m: number | null;
  relative_sigma_median: number | null;
  age_median_s: number | null;
  oldest_s: number | null;
  surveyed_fraction: number | null;
  survey_job_id: string | null;
  png_url: string;
  ply_url: string;
};

export type DepthDocument = {
  x_px: number;
  y_px: number;
  distance_m: number;
  distance_sigma_m: number;
  point_rig_m: [number, number, number];
  fixation_id: string;
  age_s: number;
};

export type StopDocument = { engaged: boolean; since_utc: string | null; by: string | null; parked?: boolean };
export type LeaseDocument = { holder: string | null; expires_in_s: number | null; token?: string };

export type RigEvent = {
  id: number | string;
  kind: string;
  level: "debug" | "info" | "warning" | "error";
  t_utc: string;
  message: string;
  data: Record<string, unknown> | null;
};

// What travels on the view socket, and between the page and its worker.

export type ViewInfo = { index: number; name: ViewName; width: number; height: number };
export type Hello = { type: "hello"; views: ViewInfo[]; server: string };
export type Overlay = {
  type: "overlay";
  seq: number;
  footprints: { left: [number, number][] | null; right: [number, number][] | null };
  gaze: { left: Direction | null; right: Direction | null };
};
export type ServerStats = {
  type: "stats";
  views: Partial<Record<ViewName, { rate_hz: number | null; age_ms: number | null; frozen_since_ms: number | null }>>;
};
export type Subscription = Partial<Record<ViewName, { scale: 1 | 2 }>>;
export type ShownView = {
  count: number;
  fps: number;
  age_ms: number;
  seq: number;
  width: number;
  height: number;
  scale: number;
  frozen: boolean;
  silent_ms: number;
};
export type StreamReport =
  | { type: "hello"; hello: Hello }
  | { type: "down"; retry_in_ms: number }
  | { type: "overlay"; overlay: Overlay }
  | { type: "stats"; stats: ServerStats }
  | { type: "shown"; views: Partial<Record<ViewName, ShownView>> };
export type StreamOrder =
  | { type: "start"; url: string }
  | { type: "canvas"; view: ViewName; canvas: OffscreenCanvas }
  | { type: "loupe-canvas"; canvas: OffscreenCanvas }
  | { type: "loupe"; at: Point | null; zoom: number }
  | { type: "subscribe"; views: Subscription };

// What the page keeps.

export type CurrentFixation = {
  job_id: string | null;
  request: FixationRequest | null;
  state: "sending" | JobState;
  steps: VergeStep[];
  note: string | null;
  fixation: FixationDocument | null;
  problem: ProblemDocument | null;
  mine: boolean;
};

export type LinkState = "connecting" | "open" | "down";

export type ConsoleState = CalibrationState & RigPageState & CapturePageState & GalleryState & RecordingState & PlannerPageState & MeasureState & {
  stream: LinkState;
  events_link: LinkState;
  boot_id: string | null;
  rig: RigDocument | null;
  intrinsics: Intrinsics | null;
  reach: ReachDocument | null;
  views: ViewInfo[];
  shown: Partial<Record<ViewName, ShownView>>;
  server_stats: ServerStats["views"];
  overlay: Overlay | null;
  current: CurrentFixation | null;
  targets: TargetDocument[] | null;
  hidden_targets: string[];
  selected_target: string | null;
  clouds: CloudDocument[];
  log: RigEvent[];
  stop: StopDocument | null;
  lease: LeaseDocument | null;
  lease_token: string | null;
  steer_distance_m: number | null;
  settings: Settings;
};

export type Settings = {
  theme: "system" | "dark" | "light";
  wide_size: "auto" | "full" | "half";
  fovea_size: "auto" | "full" | "half";
  footprints: boolean;
  field: boolean;
  marks: boolean;
  readout: boolean;
  scene: boolean;
  single_keys: boolean;
  hints: boolean;
};
