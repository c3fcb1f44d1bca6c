// What the server says of things that are made of a dataset. Types only: no browser loads this file.

import type { ProblemDocument } from "../types.js";

export type MakingProgress = { done: number; total: number; eta_s: number | null; note: string };

/** `refusal`: why there can be none. */
export type MakingDocument = {
  capture_id: string;
  name: string;
  state: "none" | "unfinished" | "building" | "complete";
  job_id: string | null;
  progress: MakingProgress | null;
  refusal: ProblemDocument | null;
  url: string;
};
