// What the server says of stills. Types only: no browser loads this file.

import type { ProblemDocument, Role } from "../types.js";

export type StillCamera = {
  camera: Role;
  asked: number;
  came: number;
  files: number;
  width: number;
  height: number;
  channels: number;
  bits: number;
  exposure_ms: number | null;
  gain_db: number | null;
  first_t_ns: number | null;
  last_t_ns: number | null;
  x_v: number | null;
  y_v: number | null;
  ax_deg: number | null;
  ay_deg: number | null;
  detail: string;
  remedy: string;
};

export type StillDocument = {
  id: string;
  name: string;
  label: string;
  licence: string;
  state: "held" | "kept" | "removed";
  trouble: string;
  created_utc: string | null;
  codec: "tiff" | "png" | null;
  rig_id: string | null;
  calibration_id: string | null;
  stack_frames: number;
  stack_keep: "mean" | "all";
  cameras: StillCamera[];
  distance_m: number | null;
  rail_mm: number | null;
  pan_deg: number | null;
  tilt_deg: number | null;
  size_bytes: number;
  warnings: string[];
  folder: string;
  url: string;
};

export type StillWish = {
  stack_frames: number;
  stack_keep: "mean" | "all";
  cameras: Role[];
  name: string | null;
  label: string;
  save: boolean;
};

export type StillChecked = { id: string; sound: boolean; faults: string[] };

/** The press under way, or how the last one ended: `problem` null while it runs and when all went well. */
export type StillPress = { job_id: string; over: boolean; done: number; total: number | null; problem: ProblemDocument | null };
