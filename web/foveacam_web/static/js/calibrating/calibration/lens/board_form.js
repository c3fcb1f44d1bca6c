// The fields that name a calibration board: kind, inner corners, sides.

import { allHold, choiceField, numberField, tickField } from "../../../elements/parts.js";

/**
 * @import { BoardDocument } from "#api"
 * @typedef {{elements: HTMLElement[], holds: () => boolean, value: () => BoardDocument | null, put: (board: BoardDocument | null, of?: string | null) => void}} BoardForm
 *   `put`: show a board, `of` a session; what somebody has typed stays until another session is opened
 */

const CELLS = [4, 5, 6, 7];
const COUNTS = [50, 100, 250, 1000];
/** @type {BoardDocument["dictionary"]} */
const USUAL = "4X4_50";
const DICTIONARIES = /** @type {BoardDocument["dictionary"][]} */ (
  CELLS.flatMap((cells) => COUNTS.map((count) => `${cells}X${cells}_${count}`))
);

/** Build the fields; `value` is null while they are empty, when the server's choice is used. @returns {BoardForm} */
export function boardForm() {
  const kind = choiceField(
    "Board",
    [
      ["charuco", "ChArUco"],
      ["checkerboard", "Checkerboard"],
    ],
    () => offer(),
  );
  const columns = numberField("Columns", { min: 3, max: 40 });
  const rows = numberField("Rows", { min: 3, max: 40 });
  const square = numberField("Square", { min: 0.5, max: 500, step: "any", unit: "mm" });
  const marker = numberField("Marker", { min: 0.3, max: 500, step: "any", unit: "mm" });
  const dictionary = choiceField(
    "Dictionary",
    DICTIONARIES.map((name) => [name, name]),
  );
  const legacy = tickField("Drawn by OpenCV before 4.6", false);
  const offer = () => {
    for (const { element } of [marker, dictionary, legacy]) element.hidden = kind.value() !== "charuco";
  };
  const elements = [kind, columns, rows, square, marker, dictionary, legacy].map(({ element }) => element);
  let [known, typed] = ["", false];
  /** @type {string | null} */
  let source = null;
  for (const element of elements)
    for (const type of ["input", "change"]) element.addEventListener(type, () => (typed = true));
  return {
    elements,
    holds: () => allHold(columns, rows, square, marker),
    value: () => {
      const lattice = latticeOf(columns.value(), rows.value(), square.value());
      if (lattice === null || kind.value() === "checkerboard") return lattice;
      const name = /** @type {BoardDocument["dictionary"]} */ (dictionary.value());
      const markers = { marker_mm: marker.value(), dictionary: name, legacy_pattern: legacy.value() };
      return { ...lattice, kind: "charuco", ...markers };
    },
    put: (board, of = null) => {
      const now = JSON.stringify([board, of]);
      if (now === known) return;
      typed = typed && (source === null || source === of); // the first answer may come late
      [known, source] = [now, of];
      if (typed) return;
      kind.put(board?.kind ?? "charuco");
      columns.put(board?.columns ?? null);
      rows.put(board?.rows ?? null);
      square.put(board?.square_mm ?? null);
      marker.put(board?.marker_mm ?? null);
      dictionary.put(board?.dictionary ?? USUAL);
      legacy.put(board?.legacy_pattern ?? false);
      offer();
    },
  };
}

/**
 * Return the plain board that the fields name; null when they are empty and the session's own is used.
 * @param {number | null} columns
 * @param {number | null} rows
 * @param {number | null} square_mm
 * @returns {BoardDocument | null}
 */
function latticeOf(columns, rows, square_mm) {
  if (columns === null || rows === null || square_mm === null) return null;
  const markers = { marker_mm: null, dictionary: USUAL, legacy_pattern: false };
  return { kind: "checkerboard", columns, rows, square_mm, ...markers };
}
