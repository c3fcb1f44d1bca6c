// What the server says of the rig's devices, and what the page keeps of them. Types only: no browser loads this file.

import type { Role } from "../types.js";

export type Span = { low: number; high: number };
export type ExposureAuto = "off" | "once" | "continuous";
export type CameraRanges = {
  exposure_ms: Span;
  exposure_auto: ExposureAuto[];
  gain_db: Span;
  black_level: Span;
  frame_rate_hz: Span;
  frame_rate_auto: boolean;
  pixel_formats: string[];
};
export type NumberName = "exposure_ms" | "gain_db" | "black_level" | "frame_rate_hz";
export type CameraSettings = Record<NumberName, number> & {
  exposure_auto: ExposureAuto;
  frame_rate_auto: boolean;
  pixel_format: string;
  trigger: "none" | "hardware" | "software";
  kept: boolean;
};
export type CameraPhase = "closed" | "opening" | "ready" | "streaming" | "degraded" | "lost" | "backoff";
export type CameraLink = { phase: CameraPhase; reason: string; since_s: number | null; epoch: number };

export type CameraDocument = {
  role: Role;
  vendor: string | null;
  model: string | null;
  serial: string | null;
  version?: string;
  connected: boolean;
  width: number | null;
  height: number | null;
  exposure_ms: number | null;
  frame_rate_hz: number | null;
  frame_age_ms: number | null;
  delivered: number;
  skipped: number;
  dropped: number;
  incomplete?: number;
  late?: number;
  underrun?: number;
  settings?: CameraSettings;
  ranges?: CameraRanges;
  link?: CameraLink;
};

export type SettingName = NumberName | "exposure_auto" | "pixel_format" | "trigger";
export type Difference = { setting: SettingName; left: number | string; right: number | string };
export type CameraPatch = Partial<Record<NumberName, number>> & { exposure_auto?: ExposureAuto; frame_rate_auto?: boolean; pixel_format?: string };
export type CamerasChanged = { cameras: CameraDocument[]; divergence: Difference[] };

export type TriggerDocument = { settle_us: number; settle_source: string; interval_ms: number | null; rate_hz: number | null };
export type Verdict = "untested" | "ok" | "ok_software_only" | "camera" | "wiring" | "no_probe";
export type EyeTest = { eye: "left" | "right"; verdict: Verdict; detail: string; software_ms: number | null; hardware_ms: number | null };
export type TriggerTest = { id: string; created_utc: string; eyes: EyeTest[] };

export type StreamOfController = { stream: number; updates_per_s: number; left_x_v: number; left_y_v: number; right_x_v: number; right_y_v: number };
export type ControllerLink = {
  tx_bytes: number;
  rx_bytes: number;
  tx_packets: number;
  rx_packets: number;
  bad_packets: number;
  crc: boolean;
  crc_errors: number;
  lost_answers: number;
  tx_bytes_per_s: number;
  rx_bytes_per_s: number;
  tx_packets_per_s: number;
  rx_packets_per_s: number;
  queued_bytes: number;
  rtt_p50_ms: number;
  rtt_p95_ms: number;
  rtt_p99_ms: number;
  rtt_max_ms: number;
  update_limit_hz: number;
  clock_offset_ms: number;
  clock_drift_ppm: number | null;
  streams: StreamOfController[];
};
export type DeviceInfo = { vendor: string; model: string; serial: string; version: string; port?: string };

export type RailDocument = {
  present: boolean;
  info: DeviceInfo | null;
  moves_itself: boolean;
  wanted_mm: number | null;
  connected: boolean;
  homed: boolean;
  moving: boolean;
  position_mm: number | null;
  fault: string | null;
  awaits_zero: boolean;
  limits: { min_mm: number; max_mm: number } | null;
  places: { name: string; position_mm: number }[];
};

export type Knock = { shift_x_deg: number; shift_y_deg: number; rotation_deg: number };
/** What is broken on purpose in a simulated rig. */
export type RigFaults = {
  unplugged: string[];
  frozen: string[];
  no_trigger: string[];
  no_strobe: string[];
  dead_axes: string[];
  knocked_left: Knock;
  knocked_right: Knock;
};

/** The self-test that this page has begun. */
export type RunningTest = { job_id: string; note: string; done: number; total: number | null };

export type RigPageState = {
  rig_page: boolean;
  rail: RailDocument | null;
  faults: RigFaults | null;
  trigger_test: TriggerTest | null;
  running_test: RunningTest | null;
};
