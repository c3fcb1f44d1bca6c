// Texts of the page of the engine's load. Pure functions.

import { count, MISSING, millis, number, sentence, span } from "../../elements/format.js";

/**
 * @import { EngineDocument, MirrorsDocument, StartTimeDocument, ThreadDocument, ViewFlowDocument } from "#api"
 */

const FILE_FORMAT = "foveacam-engine";
const FILE_VERSION = 1;
/** A thread that uses less than this is listed as idle. */
const IDLE_SHARE = 0.005;
const HARDWARE = "foveacam-hardware";

/** @type {Record<string, string>} */
const STAGES = {
  queue: "Waiting for the hardware thread",
  look: "A look of both eyes",
  verge: "A fixation",
  depth: "Depth of a fixation",
  encode: "A picture as JPEG",
  request: "A request until its answer",
};

/** @param {number | null} share */
export function percent(share) {
  return share === null ? MISSING : `${number(100 * share, share > 0 && share < 0.1 ? 1 : 0)} %`;
}

/** @param {string} stage */
export function stageWords(stage) {
  return STAGES[stage] ?? sentence(stage).replace(/\.$/, "");
}

/**
 * Return a sentence for each part that does not keep up, or one that all is well.
 * @param {EngineDocument} engine
 * @returns {{tone: "good" | "warn", sentences: string[]}}
 */
export function verdict({ hardware, event_loop, threads, cameras, views }) {
  const found = [
    hardware.flagged &&
      `The hardware thread is busy ${percent(hardware.busy_share)} of the time: live views get slower.`,
    event_loop.flagged &&
      `The event loop was ${millis(event_loop.worst_lag_ms)} late: pages and orders are answered late.`,
    ...threads
      .filter(({ name, flagged }) => flagged && !(name === HARDWARE && hardware.flagged))
      .map(({ name, busiest_share }) => `The thread ${name} uses ${percent(busiest_share)} of a core: its work waits.`),
    ...cameras
      .filter(({ flagged }) => flagged)
      .map(({ role, lost_last_minute }) => `The ${role} camera lost ${frames(lost_last_minute)} in the last minute.`),
    ...views
      .filter(({ slow_reason }) => slow_reason !== null)
      .map((view) => `The ${viewName(view)} view shows ${rateWords(view)} pictures a second: ${view.slow_reason}.`),
  ].filter((text) => text !== false);
  if (found.length > 0) return { tone: "warn", sentences: found };
  const rates = views.filter(({ expected_hz }) => expected_hz !== null);
  const shown = rates.map((view) => `${viewName(view)} ${rateWords(view)}`).join(", ");
  const told = shown && `Live pictures a second: ${shown}.`;
  return { tone: "good", sentences: ["Everything keeps up.", told].filter(Boolean) };
}

/** @param {Pick<ViewFlowDocument, "view">} view */
function viewName({ view }) {
  return view.replaceAll("_", " ");
}

/** @param {Pick<ViewFlowDocument, "rate_hz" | "expected_hz">} view */
function rateWords({ rate_hz, expected_hz }) {
  return `${number(rate_hz, rate_hz < 10 ? 1 : 0)} of ${number(expected_hz ?? 0, 0)}`;
}

/** @param {number} lost */
function frames(lost) {
  return `${count(lost)} ${lost === 1 ? "frame" : "frames"}`;
}

/**
 * Divide the threads into those that work and the names of those that rest; where nothing is known, all are rows.
 * @param {ThreadDocument[]} threads
 */
export function workingAndIdle(threads) {
  const rests = (/** @type {ThreadDocument} */ { cpu_share }) => cpu_share !== null && cpu_share < IDLE_SHARE;
  return {
    working: threads.filter((thread) => !rests(thread)),
    idle: threads.filter(rests).map(threadName).sort(),
  };
}

/** @param {ThreadDocument} thread */
export function threadName({ name, count }) {
  return count === 1 ? name : `${name} × ${count}`;
}

/** @param {EngineDocument} engine @returns {[string, string][]} */
export function processRows({ process, version }) {
  const { cores, cpu_share, memory_mb, open_files, open_files_limit, database_mb, up_s } = process;
  return [
    ["Version", version],
    ["Runs for", span(up_s)],
    ["CPU", cpu_share === null ? MISSING : `${number(cpu_share, 2)} of ${cores} cores`],
    ["Memory", memory_mb === null ? MISSING : `${count(Math.round(memory_mb))} MB`],
    ["Open files", open_files === null ? MISSING : `${count(open_files)} of ${count(open_files_limit)}`],
    ["Database", `${number(database_mb, 1)} MB`],
  ];
}

/** @param {EngineDocument} engine @returns {[string, string][]} */
export function queueRows({ hardware, event_loop }) {
  return [
    ["Hardware thread busy", percent(hardware.busy_share)],
    ["Commands waiting for it", `${hardware.queue_length} of ${hardware.queue_limit}`],
    [`Event loop late, worst of ${number(event_loop.window_s, 0)} s`, millis(event_loop.worst_lag_ms)],
  ];
}

/** @param {StartTimeDocument} step @returns {[string, string, string, string]} */
export function startRow({ device, state, after_s, duration_s }) {
  return [device.replaceAll("_", "-"), state, seconds(after_s), seconds(duration_s)];
}

/** @param {EngineDocument["process"]} process */
export function startWords({ began_utc, services_opened_s }) {
  if (began_utc === null) return "The operating system does not report when the process began.";
  const at = began_utc.replace("T", " ").replace("Z", " UTC");
  return `The process began on ${at}; its services were open ${seconds(services_opened_s)} later.`;
}

/** @param {number | null} time_s */
function seconds(time_s) {
  return time_s === null ? MISSING : `${number(time_s, time_s < 10 ? 2 : 1)} s`;
}

/**
 * Return name and content of the file that is saved.
 * @param {EngineDocument} engine
 * @param {MirrorsDocument | null} mirrors
 */
export function savedFile(engine, mirrors) {
  return {
    name: `engine-${engine.utc.slice(0, 19).replaceAll(":", ".")}Z.json`,
    content: JSON.stringify({ format: FILE_FORMAT, version: FILE_VERSION, engine, mirrors }, null, 1),
  };
}
