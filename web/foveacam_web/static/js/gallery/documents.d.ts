// What the server says of captures, and what the page keeps of the gallery. Types only: no browser loads this file.

/** Where in the gallery one is; `id` null: the list; `part`: another page about one thing. */
export type GalleryPlace = { tab: string; id: string | null; part: string | null };

export type GalleryState = {
  gallery: GalleryPlace | null;
};
