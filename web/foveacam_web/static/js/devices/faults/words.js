// The rows of the fault tray: order, counts, texts. Pure functions.

/**
 * @import { FaultDocument } from "#api"
 * @typedef {{scope: string, name: string, what: string, remedy: string, lasting: boolean}} PageFault
 */

export const MOST = 50;

const SCOPES = Object.freeze(
  /** @type {Record<string, string>} */ ({
    calibration: "Calibration",
    camera: "Camera",
    cloud: "3D shape",
    device: "Device",
    follow: "Following",
    job: "Job",
    link: "Connection",
    loop: "Vergence loop",
    page: "This page",
    storage: "Storage",
    view: "View",
  }),
);

/**
 * Return the faults of the server and of the page as one list: errors first, the newest first within, 50 at most.
 * @param {FaultDocument[]} server
 * @param {FaultDocument[]} page
 */
export function trayRows(server, page) {
  const rank = (/** @type {FaultDocument} */ { level }) => (level === "error" ? 0 : 1);
  const rows = [...server, ...page].sort((a, b) => rank(a) - rank(b) || b.last_utc.localeCompare(a.last_utc));
  return rows.slice(0, MOST);
}

/** Return the tone of the button: "bad" while an error is present, "warn" for all other rows. @param {FaultDocument[]} rows */
export function trayTone(rows) {
  if (rows.length === 0) return "none";
  return rows.some(({ level, present }) => level === "error" && present) ? "bad" : "warn";
}

/** Return the button's label for screen readers and its hint. @param {FaultDocument[]} rows */
export function trayLabel(rows) {
  if (rows.length === 0) return "Faults and warnings: none";
  const errors = rows.filter(({ level }) => level === "error").length;
  const present = rows.filter((row) => row.present).length;
  const parts = [counted(errors, "error"), counted(rows.length - errors, "warning")].filter(Boolean);
  return `Faults and warnings, ${rows.length}: ${parts.join(", ")}; ${present === 0 ? "all over" : `${present} present`}`;
}

/** @param {number} number @param {string} noun */
function counted(number, noun) {
  return number === 0 ? "" : `${number} ${noun}${number === 1 ? "" : "s"}`;
}

/** Return what a fault concerns. @param {FaultDocument} row */
export function placeWords({ scope, name }) {
  const words = SCOPES[scope] ?? scope.replaceAll("_", " ");
  return `${words}: ${name.replaceAll("_", " ")}`;
}

/**
 * Return how often and when a fault came.
 * @param {FaultDocument} row
 * @param {(utc: string) => string} time
 */
export function whenWords({ count, first_utc, last_utc, present, over_utc }, time) {
  const begun =
    count === 1 ? [time(first_utc)] : [`${count} times`, `first ${time(first_utc)}`, `last ${time(last_utc)}`];
  const lasted = over_utc !== null && over_utc !== last_utc;
  return [...begun, !present && lasted && `over since ${time(over_utc)}`].filter(Boolean).join(", ");
}

/**
 * Return the page's own faults with one more; the same one is counted.
 * @param {FaultDocument[]} rows
 * @param {PageFault} fault
 * @param {string} utc now
 * @returns {FaultDocument[]}
 */
export function withPageFault(rows, { scope, name, what, remedy, lasting }, utc) {
  const id = `page ${scope} ${name} ${what}`;
  const known = rows.find((row) => row.id === id);
  /** @type {FaultDocument} */
  const row = {
    id,
    level: "error",
    scope,
    name,
    what,
    remedy,
    first_utc: known?.first_utc ?? utc,
    last_utc: utc,
    count: (known?.count ?? 0) + 1,
    present: lasting,
    over_utc: lasting ? null : utc,
  };
  return [row, ...rows.filter((each) => each.id !== id)].slice(0, MOST);
}

/**
 * Return the page's own faults, those of a scope no longer present.
 * @param {FaultDocument[]} rows
 * @param {string} scope
 * @param {string} utc now
 */
export function withoutPresent(rows, scope, utc) {
  return rows.map((row) => (row.scope === scope && row.present ? { ...row, present: false, over_utc: utc } : row));
}
