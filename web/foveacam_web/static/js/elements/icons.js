// Defines the page's icons as strokes on a 16 px grid, so that no file is fetched for them.

import { html } from "./dom.js";

const PATHS = Object.freeze({
  expand: "M2 6V2h4 M14 10v4h-4 M10 2h4v4 M6 14H2v-4",
  shrink: "M6 2v4H2 M10 14v-4h4 M14 6h-4V2 M2 10h4v4",
  plus: "M8 3v10 M3 8h10",
  minus: "M3 8h10",
  columns: "M2 3h12v10H2z M8 3v10",
  rows: "M2 3h12v10H2z M2 8h12",
  aside: "M6.5 3H2.5v10.5H13V9.5 M9 2.5h4.5V7 M13.5 2.5L7.5 8.5",
  fit: "M2.5 3.5h11v9h-11z M5.5 6.5h5v3h-5z",
  target: "M8 1v4 M8 11v4 M1 8h4 M11 8h4 M8 7.5v1 M7.5 8h1",
  again: "M13 8a5 5 0 1 1-1.6-3.7 M13 2v3h-3",
  trash: "M3 4.5h10 M6.5 4.5v-2h3v2 M4.5 4.5l.6 9h5.8l.6-9",
  cube: "M8 1.8l5.4 3v6.4L8 14.2l-5.4-3V4.8z M2.8 4.9L8 7.8l5.2-2.9 M8 7.8v6.2",
  gear: "M8 5.6a2.4 2.4 0 1 0 0 4.8a2.4 2.4 0 1 0 0-4.8z M8 1.5v2 M8 12.5v2 M1.5 8h2 M12.5 8h2 M3.4 3.4l1.4 1.4 M11.2 11.2l1.4 1.4 M12.6 3.4l-1.4 1.4 M4.8 11.2l-1.4 1.4",
  help: "M5.5 6a2.5 2.5 0 1 1 3.7 2.2c-.8.4-1.2.9-1.2 1.8 M8 12.6v.4",
  sun: "M8 5a3 3 0 1 0 0 6a3 3 0 1 0 0-6z M8 1v1.5 M8 13.5V15 M1 8h1.5 M13.5 8H15 M3 3l1 1 M12 12l1 1 M13 3l-1 1 M4 12l-1 1",
  moon: "M13 9.5A5.5 5.5 0 0 1 6.5 3a5.5 5.5 0 1 0 6.5 6.5z",
  close: "M4 4l8 8 M12 4l-8 8",
  warn: "M8 2l6.5 11.5h-13z M8 6.5v3.2 M8 11.6v.2",
  info: "M8 2a6 6 0 1 0 0 12a6 6 0 1 0 0-12z M8 7.3v3.7 M8 5v.2",
  check: "M3 8.5l3.5 3.5L13 5",
  hand: "M4 8V5a1 1 0 0 1 2 0V3.5a1 1 0 0 1 2 0V3a1 1 0 0 1 2 0v1.5a1 1 0 0 1 2 0V10a4 4 0 0 1-4 4c-2 0-3-1-4-3L2.6 8.8a1 1 0 0 1 1.7-1z",
  down: "M8 2v8 M4.5 7L8 10.5L11.5 7 M3 13.5h10",
  up: "M8 13V3 M4 7l4-4l4 4",
  low: "M8 3v10 M4 9l4 4l4-4",
  back: "M13 8H3 M7 4L3 8l4 4",
  on: "M3 8h10 M9 4l4 4l-4 4",
  scope:
    "M8 2.5a5.5 5.5 0 1 0 0 11a5.5 5.5 0 1 0 0-11z M8 6a2 2 0 1 0 0 4a2 2 0 1 0 0-4z M8 .8v1.7 M8 13.5v1.7 M.8 8h1.7 M13.5 8h1.7",
  sliders: "M3.5 2v6 M3.5 12v2 M8 2v2 M8 8v6 M12.5 2v7 M12.5 13v1 M1.5 10h4 M6 6h4 M10.5 11h4",
  link: "M6.5 9.5l3-3 M7 4.5l1.5-1.5a3 3 0 0 1 4.5 4.5L11.5 9 M9 11.5L7.5 13A3 3 0 0 1 3 8.5L4.5 7",
  file: "M4 1.8h5l3 3v9.4H4z M9 1.8v3h3",
  pictures: "M1.8 3h12.4v10H1.8z M1.8 11l3.7-3.7l3 3l2-2l3.7 3.7 M10.6 5.6v.2",
  map: "M2 4l4-1.5l4 1.5l4-1.5v9.5l-4 1.5l-4-1.5l-4 1.5z M6 2.5v9.5 M10 4v9.5",
  raster: "M2 3.5h12 M14 3.5v4.5 M14 8h-12 M2 8v4.5 M2 12.5h12 M2 3.4v.2 M8 3.4v.2 M8 7.9v.2 M8 12.4v.2 M14 12.4v.2",
  record: "M8 3.5a4.5 4.5 0 1 0 0 9a4.5 4.5 0 1 0 0-9z",
  square: "M4.5 4.5h7v7h-7z",
  play: "M5 3l8 5l-8 5z",
  pause: "M5.5 3v10 M10.5 3v10",
  previous: "M11 3.5L6 8l5 4.5 M4 3.5v9",
  next: "M5 3.5L10 8l-5 4.5 M12 3.5v9",
  ruler: "M1.8 10.6l8.8-8.8l3.6 3.6l-8.8 8.8z M4 8.4l1.5 1.5 M6.2 6.2l2.2 2.2 M8.4 4l1.5 1.5",
  follow: "M10.5 4.5a3.5 3.5 0 1 0 0 7a3.5 3.5 0 1 0 0-7z M10.5 7.9v.2 M2 5.5h3 M1 8h3.5 M2 10.5h3",
  verge: "M2.5 14L8 4L13.5 14 M8 4.2v-.4 M1 14h3 M12 14h3",
  person: "M8 2.2a2.8 2.8 0 1 0 0 5.6a2.8 2.8 0 1 0 0-5.6z M2.5 14c.5-2.9 2.7-4.4 5.5-4.4s5 1.5 5.5 4.4",
  scales: "M8 2v12 M4.5 14h7 M2 5h12 M2 5l-1 4h4l-1-4 M12 5l-1 4h4l-1-4",
});

/** @typedef {keyof typeof PATHS} IconName */

/** Draw an icon. Screen readers skip it and read its button. @param {IconName} name */
export function icon(name) {
  return html`<svg class="icon" viewBox="0 0 16 16" aria-hidden="true"><path d=${PATHS[name]}></path></svg>`;
}
