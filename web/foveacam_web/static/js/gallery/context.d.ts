// What the gallery hands to what it opens. Types only: no browser loads this file.

import type { Commands } from "../commands.js";
import type { Store } from "../store.js";
import type { Reader } from "../sync.js";
import type { GalleryPlace } from "./documents.js";

/** `signal`: aborted when somebody leaves. */
export type GalleryContext = {
  store: Store;
  commands: Commands;
  signal: AbortSignal;
  follow: (reader: Reader) => void;
};

export type GalleryTab = {
  name: string;
  title: string;
  open: (at: GalleryPlace, context: GalleryContext) => HTMLElement;
};
