// The fields that name a calibration board: kind, inner corners, sides.

import { allHold, choiceField, numberField } from "../../../elements/parts.js";

/**
 * @import { BoardDocument } from "#api"
 * @typedef {{elements: HTMLElement[], holds: () => boolean, value: () => BoardDocument | null, put: (board: BoardDocument | null) => void}} BoardForm
 */

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
  const offer = () => (marker.element.hidden = kind.value() !== "charuco");
  let known = "";
  return {
    elements: [kind, columns, rows, square, marker].map(({ element }) => element),
    holds: () => allHold(columns, rows, square, marker),
    value: () => boardOf(kind.value(), columns.value(), rows.value(), square.value(), marker.value()),
    put: (board) => {
      const now = JSON.stringify(board);
      if (now === known) return; // what somebody is typing stays
      known = now;
      kind.put(board?.kind ?? "charuco");
      columns.put(board?.columns ?? null);
      rows.put(board?.rows ?? null);
      square.put(board?.square_mm ?? null);
      marker.put(board?.marker_mm ?? null);
      offer();
    },
  };
}

/**
 * Return the board that the options name; null when the fields are empty and the session's own is used.
 * @param {string} kind
 * @param {number | null} columns
 * @param {number | null} rows
 * @param {number | null} square_mm
 * @param {number | null} marker_mm
 * @returns {BoardDocument | null}
 */
function boardOf(kind, columns, rows, square_mm, marker_mm) {
  if (columns === null || rows === null || square_mm === null) return null;
  return {
    kind: kind === "checkerboard" ? "checkerboard" : "charuco",
    columns,
    rows,
    square_mm,
    marker_mm: kind === "charuco" ? marker_mm : null,
  };
}
