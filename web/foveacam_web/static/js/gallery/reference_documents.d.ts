// What the server says of references over a rail's long baselines. Types only: no browser loads this file.

import type { MakingDocument } from "./made_documents.js";

/** `referenced`: of the `samples` with depth by the rig's own baseline; `*_rel`: parts of the depth. */
export type MadeReference = {
  scan: number;
  bracket: number;
  across: number;
  rail_sigma_m: number;
  made_utc: string;
  baseline_m: number;
  short_baseline_m: number;
  samples: number;
  referenced: number;
  stops: ReferenceStop[];
  comparison: { wrong: number; bias_rel: number; rms_rel: number; stated_sigma_rel: number };
  svg_url: string;
  png_url: string;
  samples_url: string;
};

export type ReferenceStop = { scan: number; rail_m: number };

/** `outdated`: the dataset has grown since it was made. */
export type ReferenceDocument = MakingDocument & { outdated: boolean; stops: ReferenceStop[]; brackets: number[]; made: MadeReference | null };

/** `scan` null: the one nearest to the middle. */
export type ReferenceWish = { scan: number | null; bracket: number; across: number; rail_sigma_m: number };
