// Saves the edited plan in this browser, so that a reload or a crash of the page loses nothing.

/**
 * @import { WholeDraft } from "#page"
 * @typedef {{read: () => WholeDraft, put: (draft: WholeDraft) => void}} Fields
 */

const DRAFT_KEY = "foveacam.capture.draft";
const VERSION = 1; // raised when a field changes its meaning; older drafts are then ignored
const REST_MS = 300; // from the last key to saving

/** @type {Readonly<Record<string, readonly string[]>>} */
const CHOICES = Object.freeze({
  source: ["grid", "set_points"],
  order: ["serpentine", "rows"],
  field: ["all", "extent", "step", "overlap"],
  mode: ["scene", "given", "parallel"],
  stack_keep: ["mean", "all"],
  wide: ["point", "scan", "none"],
  codec: ["tiff", "png"],
});

/**
 * Restore the saved draft, and save from now on what differs from the defaults.
 * @param {Fields} fields that hold the defaults
 */
export function keepDraft({ read, put }) {
  const defaults = read();
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  let timer;
  const differs = () => JSON.stringify(read()) !== JSON.stringify(defaults);
  const write = () => {
    clearTimeout(timer);
    timer = undefined;
    writeDraft(differs() ? read() : null);
  };
  window.addEventListener("pagehide", () => timer !== undefined && write());
  const kept = readDraft(defaults);
  if (kept) put(kept);
  return {
    defaults,
    differs,
    changed: () => {
      clearTimeout(timer);
      timer = setTimeout(write, REST_MS);
    },
  };
}

/**
 * Return the saved draft; null when there is none that can be used.
 * @param {WholeDraft} defaults
 * @returns {WholeDraft | null}
 */
function readDraft(defaults) {
  try {
    const { version, draft } = JSON.parse(localStorage.getItem(DRAFT_KEY) ?? "{}");
    const whole =
      version === VERSION && Object.entries(defaults).every(([name, usual]) => fits(name, draft[name], usual));
    return whole ? draft : null;
  } catch {
    return null; // private mode or a damaged entry: use the defaults
  }
}

/** @param {WholeDraft | null} draft null: the defaults, which are not saved */
function writeDraft(draft) {
  try {
    if (draft) localStorage.setItem(DRAFT_KEY, JSON.stringify({ version: VERSION, draft }));
    else localStorage.removeItem(DRAFT_KEY);
  } catch {
    // private mode: the draft lasts until the page closes
  }
}

/**
 * Return whether a field can hold a saved value.
 * @param {string} name
 * @param {unknown} value
 * @param {unknown} usual its default
 */
function fits(name, value, usual) {
  const choices = CHOICES[name];
  if (choices) return typeof value === "string" && choices.includes(value);
  if (Array.isArray(usual)) return Array.isArray(value) && value.every(Number.isFinite);
  if (typeof usual === "number" || usual === null) return value === null || Number.isFinite(value);
  return typeof value === typeof usual;
}
