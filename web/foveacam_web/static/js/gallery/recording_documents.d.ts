// What the server says of recordings. Types only: no browser loads this file.

import type { Role } from "../types.js";

export type RecordedStream = {
  name: string;
  role: Role | null;
  frames: number;
  fps: number;
  width: number | null;
  height: number | null;
  pixel_format: string | null;
  bits: number | null;
  published: number | null;
  written: number | null;
  dropped: number | null;
  missing: number | null;
  waiting: number;
  losses: Record<string, number>;
  bytes: number | null;
};

export type RecordingDocument = {
  id: string;
  name: string;
  file: string;
  label: string;
  created_utc: string | null;
  state: "starting" | "recording" | "ending" | "complete" | "partial" | "truncated" | "damaged";
  ended: "duration" | "stopped" | "disk_reserve" | "cancelled" | "failed" | null;
  why: string;
  removed: boolean;
  duration_s: number;
  asked_s: number | null;
  left_s: number | null;
  room_s: number | null;
  room_bytes: number | null;
  size_bytes: number;
  rig_id: string | null;
  calibration_id: string | null;
  calibration_problem: string | null;
  truncated: { at_byte: number; lost_bytes: number; lost: string; reason: string } | null;
  streams: RecordedStream[];
  playable: boolean;
  job_id: string | null;
  url: string;
};

export type RecordingRequest = { name: string; roles?: Role[]; duration_s?: number | null; rate?: "full" | "live"; label?: string };

export type TimelineStream = { role: Role; name: string; fps: number; width: number; height: number; t_s: number[] };
export type TimelineDocument = { duration_s: number; calibrated: boolean; streams: TimelineStream[] };

export type RecordedFrame = {
  stream: string;
  index: number;
  t_s: number;
  exposure_ms: number | null;
  x_v: number | null;
  y_v: number | null;
  volts_source: string | null;
  ax_deg: number | null;
  ay_deg: number | null;
  footprint_px: [number, number][] | null;
  jpeg_url: string;
};

export type MomentDocument = { t_s: number; frames: Partial<Record<Role, RecordedFrame>>; meeting_m: number | null };

export type RecordedDepth = {
  t_s: number;
  z_m: number | null;
  sigma_m: number | null;
  verged_z_m: number | null;
  known: number;
  apart_ms: number;
  backend: "sgbm" | "live";
  looks: number;
  picture_url: string;
};

export type FilmShow = Role | "side-by-side" | "anaglyph";
export type FilmDocument = { name: string; recording_id: string; size_bytes: number; url: string };

/** The recording that is being made, of whoever began it. */
export type RecordingState = { recording: RecordingDocument | null };
