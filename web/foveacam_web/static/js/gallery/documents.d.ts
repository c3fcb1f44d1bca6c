// What the server says of captures, and what the page keeps of the gallery. Types only: no browser loads this file.

import type { CaptureDocument } from "../capture/documents.js";
import type { Role } from "../types.js";

/** Where in the gallery one is; `id` null: the list; `part`: another page about one thing. */
export type GalleryPlace = { tab: string; id: string | null; part: string | null };

export type GalleryState = {
  gallery: GalleryPlace | null;
};

/** A capture as it lies on the disk; `plan` and `conditions` may be of an older version. */
export type DatasetDocument = CaptureDocument & {
  folder: string;
  removed: boolean;
  codec: string | null;
  rig_id: string | null;
  calibration_id: string | null;
  plan: Record<string, unknown> | null;
  conditions: Record<string, unknown> | null;
  url: string;
};

export type PointDocument = {
  index: number;
  scan: number;
  sheet_row: number;
  sheet_column: number;
  aim_ax_deg: number | null;
  aim_ay_deg: number | null;
  distance_m: number | null;
  rail_mm: number | null;
  cameras: Role[];
  brackets: number;
};

export type PointsDocument = {
  rows: number;
  columns: number;
  points: PointDocument[];
  skipped: { index: number; why: string }[];
};

export type CaptureChecked = { id: string; sound: boolean; faults: string[] };
