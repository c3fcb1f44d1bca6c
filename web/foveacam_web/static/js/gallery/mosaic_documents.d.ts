// What the server says of mosaics. Types only: no browser loads this file.

import type { MakingDocument } from "./made_documents.js";

export type MosaicLayer = {
  name: "picture" | "depth";
  width: number;
  height: number;
  levels: number;
  tile_px: number;
  tiles_url: string;
  dzi_url: string;
};

/** `f_px`, `u0_px`, `v0_px`: pixel (x, y) is the direction ((x + u0) / f, (y + v0) / f, 1) from the eye. */
export type MadeMosaic = {
  eye: "left" | "right";
  scan: number;
  bracket: number;
  made_utc: string;
  size_bytes: number;
  width: number;
  height: number;
  f_px: number;
  u0_px: number;
  v0_px: number;
  layers: MosaicLayer[];
  cell_px: number;
  step_m: number;
  near_m: number | null;
  far_m: number | null;
  views: number;
  tiles: number;
  seams: { links: number; before_rms_px: number | null; after_rms_px: number | null; adjusted: boolean };
  depth: { known: number; seen_twice: number; between_pairs_rel_rms: number | null; median_sigma_rel: number | null };
  glb_url: string | null;
  ply_url: string | null;
  depth_picture_url: string;
};

export type MosaicNeeds = { views: number; width: number; height: number; needed_bytes: number; free_bytes: number };

export type MosaicDocument = MakingDocument & {
  outdated: boolean;
  needs: MosaicNeeds | null;
  scans: number[];
  brackets: number[];
  in_scene: boolean;
  made: MadeMosaic | null;
};

export type MosaicWish = { eye: "left" | "right"; scan: number; bracket: number };

/** Which layers are seen: `share` of the depth over the picture, 0 … 1. */
export type MosaicMix = { shown: "picture" | "depth" | "both"; share: number };
