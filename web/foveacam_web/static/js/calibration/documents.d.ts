// What the server says of calibrating, and what the page keeps of it. Types only: no browser loads this file.

import type { Intrinsics, JobState, ProblemDocument } from "../types.js";

export type EyeName = "left" | "right";
export type WizardPage = "overview" | "wide" | "mirrors" | "fit" | "check" | "settle";
export type RunStep = "wide" | "mirrors" | "fit" | "check" | "settle" | "all";
export type Verdict = "good" | "recalibrate" | "unknown";

export type HealthDocument = {
  score: number | null;
  verdict: Verdict;
  fixations: number;
  vertical_px?: number | null;
  horizontal_px?: number | null;
  detail: string;
};

export type CalibrationRecord = {
  id: string;
  label: string;
  origin: string;
  rig_id: string;
  created_utc: string;
  age_s: number;
  baseline_m: number | null;
  mirror_sigma_deg: number | null;
  rectify_sigma_px: number | null;
  wide: Intrinsics;
  current?: boolean;
  kept?: boolean;
  parent_id?: string | null;
  session_id?: string | null;
  health?: HealthDocument | null;
};

export type Comparison = { a: string; b: string; picture_url?: string | null } & Record<string, unknown>;

export type Board = {
  kind: "charuco" | "checkerboard";
  columns: number;
  rows: number;
  square_mm: number;
  marker_mm: number | null;
};

export type WideSample = {
  id: string;
  thumbnail_url: string;
  rms_px: number | null;
  tilt_deg: number | null;
  centre_px: [number, number];
  corners: number;
};

export type LensFit = {
  model: string;
  rms_px: number;
  fov_x_deg: number;
  fov_y_deg: number;
  fx_px: number;
  fy_px: number;
  cx_px: number;
  cy_px: number;
  distortion: number[];
  accuracy_deg: number | null;
};

export type WideState = {
  samples: WideSample[];
  coverage_fraction: number | null;
  tilts_covered: number | null;
  fit: LensFit | null;
  other_model: LensFit | null;
  /** Why this model counts, or why there is none yet. */
  reason?: string | null;
  /** How many views have a corner of the board in each part of the picture, row by row. */
  cells?: number[][] | null;
};

export type NodeState = "centred" | "rim" | "refused" | "waiting";
export type SweepNode = {
  index: number;
  ax_deg: number;
  ay_deg: number;
  left: NodeState;
  right: NodeState;
  left_reason: string | null;
  right_reason: string | null;
};
export type Sweep = { station: string; distance_m: number | null; nodes: number; done: number; poses: SweepNode[] };

export type ModelScore = { name: string; order: number | null; eye: string; loo_deg: [number, number]; chosen: boolean };
/** A polynomial of the rectification over the field. */
export type FieldScore = { name: string; order: number | null; eye: string; loo_px: number; chosen: boolean };
/** What one addition to the paper's plain model brings. */
export type VariantStep = { name: string; pointing_rms_px: number; rectification_rms_px: number; epipolar_rms_px: number };
export type PaperFit = { steps?: VariantStep[] } & Record<string, unknown>;
export type FitResult = {
  calibration_id: string;
  models: ModelScore[];
  fields?: FieldScore[];
  volts_roundtrip_max_lsb?: number | null;
  paper: PaperFit | null;
  parallax: Record<string, unknown> | null;
  /** How each eye's mount drifted during the sweeps. */
  drift?: Record<string, { px_per_minute: number; moved_px: number; sigma_px: number; minutes: number; knocks_px?: number[] }> | null;
};

export type SettleAxis = {
  eye: string;
  axis: string;
  settle_ms: number | null;
  settle_1pct_ms: number | null;
  response_ms?: number | null;
  response_open_ms?: number | null;
  resonance_hz: number | null;
  quality: number | null;
};
/** How long the rig waits after every move; `measured`: null while the rig file's counts. */
export type SettleTime = {
  settle_us: number;
  source: string;
  rig_file_us: number;
  measured: { settle_us: number; measured_utc: string; session_id: string; low_pass_hz: number | null } | null;
};
export type CheckResult = {
  calibration_id: string;
  epipolar_rms_px: number | null;
  epipolar_p95_px: number | null;
  pointing_rms_px: number | null;
  poses: number;
};
export type Picture = { name: string; title: string; url: string };

export type SessionDocument = {
  id: string;
  label: string;
  rig_id: string;
  created_utc: string;
  bytes: number | null;
  board: Board | null;
  wide: WideState | null;
  sweeps: Sweep[];
  fit: FitResult | null;
  settle: { axes: SettleAxis[]; settle_us?: number | null; applied?: boolean } | null;
  check: CheckResult | null;
  pictures: Picture[];
  calibrations: string[];
  running: string | null;
  problems?: string[];
};

export type SessionSummary = Pick<SessionDocument, "id" | "label" | "created_utc" | "bytes" | "running">;

export type Station = { name: string; target: "board" | "markers"; pan_deg: number; tilt_deg: number; distance_m: number | null };
export type PanTiltDocument = {
  present: boolean;
  info: Record<string, unknown> | null;
  moves_itself: boolean;
  connected: boolean;
  homed: boolean;
  moving: boolean;
  pan_deg: number | null;
  tilt_deg: number | null;
  fault: string | null;
  awaits_zero: boolean;
  limits: { pan_min_deg: number; pan_max_deg: number; tilt_min_deg: number; tilt_max_deg: number } | null;
  stations: Station[];
};

export type DriftEye = {
  eye: string;
  shift_x_deg: number;
  shift_y_deg: number;
  rotation_deg: number | null;
  scale: number | null;
  sigma_deg: number | null;
  significant: boolean;
};
export type DriftCheck = {
  id: string;
  created_utc: string;
  calibration_id: string;
  looks: number;
  applied: boolean;
  new_calibration_id: string | null;
  eyes: DriftEye[];
  vergence_known: boolean;
  detail: string;
};

/** The procedure that runs, or that ran last. */
export type Work = {
  job_id: string;
  session_id: string | null;
  step: RunStep | "drift";
  stage: string;
  state: JobState;
  done: number;
  total: number | null;
  eta_s: number | null;
  note: string;
  problem: ProblemDocument | null;
  /** What it was started with; null when another page did. */
  options: Record<string, unknown> | null;
};

export type CalibrationState = {
  wizard: WizardPage | null;
  records: CalibrationRecord[] | null;
  health: HealthDocument | null;
  sessions: SessionSummary[] | null;
  session: SessionDocument | null;
  pan_tilt: PanTiltDocument | null;
  drift_checks: DriftCheck[] | null;
  settle_time: SettleTime | null;
  work: Work | null;
};
