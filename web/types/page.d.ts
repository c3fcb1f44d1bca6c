// What the page keeps and what travels on the view socket: the types that REST does not describe. No browser loads this file.

import type * as api from "#api";

// Values that fields of several documents take.

export type Role = api.StillCamera["camera"];
export type Basis = api.AlternativeDocument["basis"];
export type CameraPhase = api.CameraLinkDocument["phase"];
export type ExposureAuto = api.CameraSettingsDocument["exposure_auto"];
export type FixationState = api.FixationDocument["state"];
export type JobState = api.JobDocument["state"];
export type NodeState = api.SweepPoseDocument["left"];
export type SettingName = api.DifferenceDocument["setting"];
export type FilmShow = NonNullable<api.FilmRequest["show"]>;
export type RingBound = NonNullable<api.RingRequest["bound"]>;
export type CodecName = NonNullable<api.CaptureRequest["codec"]>;
export type MeasureKind = api.MeasurementDocument["kind"];
export type MeasuredView = api.PlaceRequest["view"];
export type Right = api.SignInDocument["rights"][number];
export type PersonRole = api.UserDocument["role"];

// Views and pixels.

export type AnnotatedName = "calibration_wide" | "calibration_left" | "calibration_right";
export type ViewName = Role | "anaglyph" | "difference" | "depth" | "wide_depth" | "wide_zoom" | AnnotatedName;

// A window of views.

export type Source = Exclude<ViewName, AnnotatedName> | "scene";
/** `row`: side by side; `column`: one below the other. */
export type Axis = "row" | "column";
/** A source, or a split; `share`: of the first part. */
export type Layout =
  Source | { readonly axis: Axis; readonly share: number; readonly parts: readonly [Layout, Layout] };
/** In shares of the window. */
export type Box = { left: number; top: number; width: number; height: number };
/** `path`: the parts that lead to the split, 0 or 1 each; `box`: of the split. */
export type Divider = { path: string; axis: Axis; share: number; box: Box };

export type Point = { x: number; y: number };
export type Corners = [number, number][];

// What travels on the view socket, and between the page and its worker.

export type ViewInfo = { index: number; name: ViewName; width: number; height: number };
export type Hello = { type: "hello"; views: ViewInfo[]; server: string };
export type Overlay = {
  type: "overlay";
  seq: number;
  footprints: { left: Corners | null; right: Corners | null };
  gaze: { left: api.Direction | null; right: api.Direction | null };
  follows: FollowMark[];
};
export type FollowMark = {
  id: string;
  label: string;
  state: api.FollowedDocument["state"];
  x_px: number;
  y_px: number;
};
/** What the server measures of a view; `expected_hz` and `slow_reason` as in REST. */
export type ViewStats = {
  rate_hz: number | null;
  age_ms: number | null;
  frozen_since_ms: number | null;
  expected_hz?: number | null;
  slow_reason?: string | null;
};
export type ServerStats = {
  type: "stats";
  views: Partial<Record<ViewName, ViewStats>>;
};
/** Sensor pixels along each side of a pixel of a picture. */
export type PictureScale = 1 | 2 | 4;

export type Subscription = Partial<Record<ViewName, { scale: PictureScale }>>;
export type ShownView = {
  count: number;
  fps: number;
  age_ms: number;
  seq: number;
  width: number;
  height: number;
  scale: number;
  /** Of the camera's picture, which the server may have made smaller still. */
  binning: number;
  frozen: boolean;
  silent_ms: number;
  /** Since the view was subscribed; null once it is so no more. */
  watched_ms: number | null;
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
  | { type: "subscribe"; views: Subscription }
  | { type: "halt"; halted: boolean };

// The console.

/** A job that is followed; of one that the server does not know any more, only these are known. */
export type Job = Pick<api.JobDocument, "id" | "state" | "problem"> & Partial<api.JobDocument>;

/** The look at full resolution that this page has ordered; null once its cloud is there. */
export type FullLook = {
  fixation_id: string;
  job_id: string | null;
  state: "sending" | JobState;
  note: string;
  problem: api.Problem | null;
};

export type CurrentFixation = {
  job_id: string | null;
  request: api.FixationRequest | null;
  state: "sending" | JobState;
  steps: api.StepDocument[];
  /** What is known of its distance so far; null before anything is. */
  estimate: api.FixationEstimate | null;
  note: string | null;
  fixation: api.FixationDocument | null;
  problem: api.Problem | null;
  mine: boolean;
};

export type LinkState = "connecting" | "open" | "down";

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
  /** How recordings are made; a `prefix` is followed by a number, without one they are named by date and time. */
  record: { prefix: string; rate: "full" | "live"; compress: boolean; packed: boolean };
};

// The rig's page.

export type CameraNumber = "exposure_ms" | "gain_db" | "black_level" | "frame_rate_hz";

export type RigPageState = {
  rig_page: RigTab | null;
  rail: api.RailDocument | null;
  faults: api.SimulatedFaults | null;
  trigger_test: api.TriggerTestDocument | null;
  /** The trigger's self-test that runs, whoever began it. */
  running_test: Job | null;
};

// The set-up page.

export type SetupState = {
  setup_page: boolean;
  setup: api.DraftDocument | null;
  /** Why the draft's file cannot be read; empty: it can. */
  setup_problem: string;
  setup_file: api.RigFileDocument | null;
  setup_files: api.RigFiles | null;
  /** Whether the draft without a file was begun here from the simulated rig; null: it was begun elsewhere. */
  setup_begun_simulated: boolean | null;
  found: api.FoundDevices | null;
  searching: boolean;
  advice: api.AdviceDocument[] | null;
  /** What came of the last try of each device. */
  tries: Record<string, api.TryResult | "asking">;
  start: api.StartDocument | null;
  start_dismissed: boolean;
};

// The settings page.

export type PreferencesState = {
  settings_page: boolean;
  camera_presets: api.CameraPreset[] | null;
  window_layouts: api.WindowLayout[] | null;
};

// The capture page.

/** A plan as it is sent: every field, set points as they were typed. */
export type PlanRequest = Required<Omit<api.RasterPlan, "format" | "version" | "points" | "verging">> & {
  points: Required<api.GridPoints> | { kind: "set_points"; points: string };
  verging: Required<api.Verging>;
};

/** The plan of an estimate, with every value that the server filled in; OpenAPI leaves it open. */
export type FilledPlan = Omit<PlanRequest, "points"> & {
  points: Required<api.GridPoints> | { kind: "set_points"; points: Required<api.SetPoint>[] };
};
export type Estimate = Omit<api.EstimateDocument, "plan"> & { plan: FilledPlan };

/** How a capture ended; `state` null: nothing of it is on the disk. */
export type CaptureEnd = {
  job: JobState;
  state: api.CaptureDocument["state"] | null;
  why: string;
  problem: api.Problem | null;
  taken: number;
  planned: number;
  resumable: boolean;
};

/** The capture that runs, or the last one; `why`: what an operator is asked to do; `end` null while it runs. */
export type Capturing = {
  job_id: string;
  capture_id: string | null;
  name: string;
  state: api.CaptureDocument["state"];
  progress: api.CaptureProgress | null;
  why: string;
  asked: "pause" | "continue" | "cancel" | null;
  end: CaptureEnd | null;
};

/** The newest answer to a question that the page asks again and again; `stale` while a newer one is awaited. */
export type Answered<T> = { stale: boolean; document: T | null; problem: api.Problem | null };

/** A fault of a plan and the field beside which it is shown; `place` null: above the button. */
export type Trouble = { place: string | null; words: string };

export type PlanDraft = {
  source: "grid" | "set_points";
  columns: number | null;
  rows: number | null;
  centre_ax_deg: number | null;
  centre_ay_deg: number | null;
  field: "all" | "extent" | "step" | "overlap";
  across: number | null;
  down: number | null;
  order: "serpentine" | "rows";
  text: string;
  mode: "scene" | "given" | "parallel";
  distance_m: number | null;
  assumed_m: number | null;
  each_point: boolean;
  exposures_ms: number[];
  stack_frames: number | null;
  stack_keep: "mean" | "all";
  wide: "point" | "scan" | "none";
  rail_positions_mm: number[];
};

/** How a capture is called and stored; `name` empty: the moment at which it begins. */
export type DraftWords = { name: string; label: string; licence: string; codec: CodecName };

/** All that is typed on the page before a capture begins. */
export type WholeDraft = PlanDraft & DraftWords;

/** The size of one fovea's view, as seen from the rig. */
export type ViewSize = { width_deg: number; height_deg: number };

export type CapturePageState = {
  capture_page: boolean;
  captures: api.CaptureDocument[] | null;
  capturing: Capturing | null;
  estimate: Answered<Estimate>;
  plan_wished: Partial<PlanDraft> | null; // fields of the plan that another page asks for
};

// The calibration page.

export type WizardPage = "overview" | "wide" | "mirrors" | "fit" | "check" | "settle";
export type RunStep = "wide" | "lens" | "mirrors" | "fit" | "check" | "settle" | "all";

/** What one addition to the paper's plain model brings. */
export type VariantStep = {
  name: string;
  pointing_rms_px: number;
  rectification_rms_px: number;
  epipolar_rms_px: number;
};

export type SessionSummary = Pick<api.SessionDocument, "id" | "label" | "created_utc" | "bytes" | "running">;

/** The procedure that runs, or that ran last. */
export type Work = {
  job_id: string;
  session_id: string | null;
  step: RunStep | "drift" | "acceptance";
  stage: string;
  state: JobState;
  done: number;
  total: number | null;
  eta_s: number | null;
  note: string;
  problem: api.Problem | null;
  /** What it was started with; null when another page did. */
  options: Record<string, unknown> | null;
};

/** What displays can show; `PatternField`: the numbers that describe it. */
export type DisplayPattern = api.PatternDocument["pattern"];
export type PatternKind = Exclude<DisplayPattern["kind"], "blank">;
export type PatternField = "columns" | "rows" | "square_mm" | "marker_mm" | "id" | "side_mm" | "spacing_mm";

export type CalibrationState = {
  wizard: WizardPage | null;
  records: api.CalibrationDocument[] | null;
  health: api.HealthDocument | null;
  sessions: SessionSummary[] | null;
  session: api.SessionDocument | null;
  pan_tilt: api.PanTiltDocument | null;
  drift_checks: api.DriftCheckDocument[] | null;
  settle_time: api.SettleTimeDocument | null;
  displays: api.DisplayDocument[] | null;
  display_pattern: api.PatternDocument | null;
  work: Work | null;
  acceptance_page: boolean;
  /** Acceptance runs, the newest first. */
  acceptances: api.AcceptanceDocument[] | null;
};

// The gallery.

/** The address of a page of the gallery; `id` null: the list; `part`: another page about one thing. */
export type GalleryPlace = { tab: string; id: string | null; part: string | null };

/** What the server makes of a dataset. */
export type MakingDocument = api.MosaicDocument | api.ReferenceDocument;

/** Which layers of a mosaic are shown; `share` of the depth over the picture, 0 … 1. */
export type MosaicMix = { shown: "picture" | "depth" | "both"; share: number };

// The planner.

/** A point of the map in metres. */
export type MapPoint = [number, number];

/** GeoJSON, as far as the page reads it. */
export type Geometry = { type: string; coordinates?: unknown; geometries?: Geometry[] };
export type Feature = { type: "Feature"; geometry: Geometry | null; properties: Record<string, unknown> | null };
export type Geojson = { type: string; features?: Feature[] };

/** Outlines of a surface, holes among them: inside is where an odd number of them goes around. */
export type Outlines = MapPoint[][];

export type PlannerNumber =
  | "feature_mm"
  | "px_per_deg"
  | "pixels"
  | "d_min_m"
  | "near_error_m"
  | "occupancy"
  | "radius_m"
  | "agent_radius_m"
  | "domain_m2";

/** Numbers as they are in their fields; NaN: not a number. */
export type PlanSettings = Record<PlannerNumber, number> & { bound: RingBound; own_domain: boolean };

export type MapKind = "random" | "open" | "geojson" | "picture";

/** How the map is made; a map of the user's own is in `GivenMap`. */
export type MapSettings = {
  kind: MapKind;
  seed: number;
  size_m: number;
  obstacles: number;
  targets: number;
};

/** A user's own map, as the server read it. */
export type GivenMap = { name: string; document: api.MapDocument; picture: string | null };

// Measuring.

/**
 * The measurement that the operator makes. `start`: the first end of a length that waits for its second; `refused`: the
 * places of one that could not be made; `view`: where the tool's bar is.
 */
export type Measuring = {
  kind: MeasureKind;
  view: MeasuredView;
  start: api.PlaceRequest | null;
  refused: api.PlaceRequest[];
  busy: boolean;
};

/** What a drag over a view draws while it lasts, picture px. */
export type MeasureDraft = { kind: MeasureKind; from: Point; to: Point };

export type MeasureState = {
  measurements: api.MeasurementDocument[] | null;
  hidden_measurements: string[];
  selected_measurement: string | null;
  measuring: Measuring | null;
};

// Following.

/** Data of the event that a target is followed no more. */
export type FollowRoundTaken = { capture_id: string; name: string; targets: number };
export type FollowEnded = { id: string; label: string; reason: string };

/** `click_follows`: a click in the wide view follows; `follow_tab`: the console's tab is open. By id: `follow_asked`, where
 * this page asked to follow, wide px; `trails`. */
export type FollowState = {
  follow_page: boolean;
  follow_tab: boolean;
  click_follows: boolean;
  followed: api.FollowedDocument[] | null;
  follow_asked: Record<string, Point>;
  trails: Record<string, api.TrailPoint[]>;
};

// The vergence loop.

/** `loop_samples`: the looks of the last 30 s, oldest first; `loop_tuning`: the job that tunes, or that tuned last;
 * `tune_refusal`: why tuning did not begin. */
export type LoopState = {
  loop_page: boolean;
  loop: api.LoopDocument | null;
  loop_samples: api.LoopSample[];
  loop_tuning: Job | null;
  tune_refusal: string;
};

// Steering by hand.

export type EyePair<T> = { left: T; right: T };
export type Volts = { x_v: number; y_v: number };
export type SteerLimits = {
  max_v: number;
  calibrated: boolean;
  shift_limit_deg: number;
  silent_after_s: number;
  park_after_s: number;
};

/** What the server tells of steering; `gaze`: the middle of both eyes' directions, null without a calibration. */
export type SteeringState = {
  status: "released" | "steering" | "silent" | "ended";
  reason: string | null;
  by: string | null;
  pose: EyePair<Volts> | null;
  target: EyePair<Volts> | null;
  gaze: api.Direction | null;
};

/** `gamepad`: whether one is there, or has gone while it steered. */
export type SteerState = {
  steering: SteeringState | null;
  steer_limits: SteerLimits | null;
  steer_refusal: string;
  steer_split: boolean;
  steer_shift_deg: number;
  gamepad: "there" | "lost" | null;
};

// The page of people and their rights.

export type RigTab = "cameras" | "mirrors" | "positioners" | "faults";
export type PeopleTab = "people" | "services" | "sign_ins" | "log";

// What all pages share, and all of it.

export type SharedState = {
  stream: LinkState;
  events_link: LinkState;
  boot_id: string | null;
  /** Who this browser is to the server; null before its answer. */
  sign_in: api.SignInDocument | null;
  /** Whether the server has said that this browser is signed out. */
  signed_out: boolean;
  rig: api.RigDocument | null;
  intrinsics: api.WideLensDocument | null;
  reach: api.ReachDocument | null;
  views: ViewInfo[];
  shown: Partial<Record<ViewName, ShownView>>;
  server_stats: ServerStats["views"];
  overlay: Overlay | null;
  current: CurrentFixation | null;
  /** Whether the eyes look where the current fixation left them. */
  eyes_stay: boolean;
  full_look: FullLook | null;
  targets: api.TargetDocument[] | null;
  hidden_targets: string[];
  selected_target: string | null;
  clouds: api.CloudDocument[];
  log: api.EventDocument[];
  server_faults: api.FaultDocument[];
  page_faults: api.FaultDocument[];
  stop: api.StopDocument | null;
  lease: api.LeaseDocument | null;
  /** Whether this page asks the holder for the lease. */
  lease_asked: boolean;
  lease_token: string | null;
  steer_distance_m: number | null;
  /** The recording that is being made, whoever began it. */
  recording: api.RecordingDocument | null;
  /** Whether the operator asked for marked targets although targets exist. */
  hints_asked: boolean;
  settings: Settings;
};

export type ConsoleState = SharedState &
  CalibrationState &
  RigPageState &
  SetupState &
  PreferencesState &
  CapturePageState &
  MeasureState &
  FollowState &
  LoopState &
  SteerState & {
    gallery: GalleryPlace | null;
    planner_page: boolean;
    compare_page: boolean;
    engine_page: boolean;
    rigs_page: boolean;
    people: PeopleTab | null;
  };
