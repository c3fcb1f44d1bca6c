// What the server says of captures and their plans, and what the page keeps of them. Types only: no browser loads this file.

import type { JobState, ProblemDocument } from "../types.js";

export type Distance = number | "infinity";
export type GridDocument = {
  kind: "grid";
  columns: number;
  rows: number;
  centre_ax_deg: number;
  centre_ay_deg: number;
  half_width_deg: number | null;
  half_height_deg: number | null;
  order: "serpentine" | "rows";
};
export type SetPoint = { ax_deg: number; ay_deg: number; distance_m: Distance | null; shift_deg: number };
export type SetPointsDocument = { kind: "set_points"; points: SetPoint[] };
export type PlanDocument = {
  points: GridDocument | SetPointsDocument;
  verging: { mode: "scene" | "given"; distance_m: Distance | null; each_point: boolean };
  exposures_ms: number[];
  stack_frames: number;
  stack_keep: "mean" | "all";
  wide: "point" | "scan" | "none";
  rail_positions_mm: number[];
};

/** A plan as it is sent: set points as they were typed. */
export type PlanWish = Omit<PlanDocument, "points"> & { points: GridDocument | { kind: "set_points"; points: string } };
export type CodecName = "tiff" | "png";
export type EstimateWish = { plan: PlanWish; codec: CodecName; distance_m: number | null };
export type CaptureWish = { name: string; plan: PlanWish; label: string; licence: string; codec: CodecName };

export type Corners = [number, number][];
export type EstimateDocument = {
  plan: PlanDocument;
  distance_assumed: boolean;
  points: number;
  shots: number;
  total_s: number;
  limit_s: number;
  reverge_s: number;
  rail_s: number;
  hand_moves: number;
  files: number;
  raw_bytes: number;
  stored_bytes: number;
  free_bytes: number;
  kinds: { kind: string; files: number; raw_bytes: number; stored_bytes: number }[];
  warnings: string[];
  coverage: {
    footprints: { left: Corners; right: Corners }[];
    seen_either: number;
    seen_both: number;
    overlap_across: number | null;
    overlap_down: number | null;
    outside_wide: number;
  };
};

export type CaptureProgress = {
  phase: "survey" | "rail" | "points" | "paused" | "closing";
  done: number;
  total: number;
  stored: number;
  written_bytes: number;
  bytes_per_s: number;
  left_s: number | null;
  note: string;
};
export type CaptureState = "starting" | "running" | "paused" | "complete" | "partial" | "damaged";
export type CaptureDocument = {
  id: string;
  name: string;
  label: string;
  licence: string;
  state: CaptureState;
  why: string;
  created_utc: string | null;
  points: { planned: number; taken: number; skipped: number; scans: number; frames: number };
  size_bytes: number;
  resumable: boolean;
  job_id: string | null;
  progress: CaptureProgress | null;
};

/** How a capture ended; `state` null: nothing of it is on the disk. */
export type CaptureEnd = {
  job: JobState;
  state: CaptureState | null;
  why: string;
  problem: ProblemDocument | null;
  taken: number;
  planned: number;
  resumable: boolean;
};

/** The capture that runs, or the last one; `why`: what somebody is asked to do; `end` null while it runs. */
export type Capturing = {
  job_id: string;
  capture_id: string | null;
  name: string;
  state: CaptureState;
  progress: CaptureProgress | null;
  why: string;
  asked: "pause" | "continue" | "cancel" | null;
  end: CaptureEnd | null;
};

/** The newest estimate; `stale` while a newer one is awaited. */
export type PlanEstimate = { stale: boolean; document: EstimateDocument | null; problem: ProblemDocument | null };

/** What is at fault in a plan, by the place where it is told; `place` null: above the button. */
export type Trouble = { place: string | null; words: string };

export type Draft = {
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

/** How a capture is called and kept; `name` empty: by the moment at which it is begun. */
export type DraftWords = { name: string; label: string; licence: string; codec: CodecName };

/** All that is typed on the page before a capture is begun. */
export type WholeDraft = Draft & DraftWords;

/** The size of one fovea's view, as seen from the rig. */
export type ViewSize = { width_deg: number; height_deg: number };

export type CapturePageState = {
  capture_page: boolean;
  captures: CaptureDocument[] | null;
  capturing: Capturing | null;
  estimate: PlanEstimate;
};
