// Keeps the calibration state equal to the server's: health always, the rest while the calibration page is open. The
// pan-tilt is read for the rig page and the acceptance page as well.

import { request } from "../../transport/api.js";
import { newestFirst, QuietReads } from "../../transport/quiet.js";
import { isRunning } from "./state.js";

/**
 * @import { DisplayDocument, EventDocument } from "#api"
 * @import { PanTiltDocument, PatternDocument, SessionDocument } from "#api"
 * @import { ConsoleState, NodeState, SessionSummary, Store } from "#console"
 * @import { WorkFollower } from "./work.js"
 */

const MOVING_MS = 350;
const RESTING_MS = 1500;
const DISPLAYS_MS = 5000;
const SESSION_MS = 1500; // each pose has an event; the session's document is read less often

/** The calibration reads of one page. */
export class CalibrationReader {
  #store;
  #work;
  #reads = new QuietReads();
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  #later;
  /** The session to show when it has been read. @type {string | null} */
  #wanted = null;
  /** The job whose session was opened. */
  #along = "";

  /** @param {{store: Store, work: WorkFollower}} context */
  constructor({ store, work }) {
    this.#store = store;
    this.#work = work;
    work.ended = () => void this.readAll();
    let open = false;
    store.on(["wizard"], ({ wizard }) => {
      if (Boolean(wizard) === open) return;
      open = Boolean(wizard);
      if (open) void this.readAll();
    });
    store.on(["acceptance_page"], ({ acceptance_page }) => acceptance_page && void this.#readAcceptancePage());
    store.on(["work", "sessions", "wizard"], (state) => this.#goAlong(state));
  }

  /**
   * Open the session of a running procedure, once for each: an operator who then opens another session stays there.
   * @param {ConsoleState} state
   */
  #goAlong({ work, sessions, wizard }) {
    if (!wizard || !work || !isRunning(work) || work.job_id === this.#along) return;
    const id = work.session_id ?? sessions?.find(({ running }) => running === work.job_id)?.id;
    if (!id) return;
    this.#along = work.job_id;
    this.#work.place(id);
    if (id === this.#store.state.session?.id) return;
    this.#wanted = id;
    void this.readSessions();
  }

  async readAll() {
    await Promise.all([this.readHealth(), this.#reads.read("work", () => this.#work.resume())]);
    if (this.#store.state.acceptance_page) await this.#readAcceptancePage();
    if (!this.#store.state.wizard) return;
    await Promise.all([
      this.readRecords(),
      this.readSessions(),
      this.readDrift(),
      this.readSettleTime(),
      this.readPanTilt(),
      this.readDisplays(),
    ]);
  }

  readHealth() {
    return this.#reads.keep(this.#store, "health", "/calibrations/health");
  }

  readRecords() {
    return this.#reads.keep(this.#store, "records", "/calibrations");
  }

  readDrift() {
    return this.#reads.keep(this.#store, "drift_checks", "/drift_checks", newestFirst);
  }

  #readAcceptancePage() {
    return Promise.all([this.#readAcceptances(), this.readPanTilt()]);
  }

  #readAcceptances() {
    return this.#reads.keep(this.#store, "acceptances", "/acceptances", newestFirst);
  }

  readSettleTime() {
    return this.#reads.keep(this.#store, "settle_time", "/settle_time");
  }

  /** Read the list of sessions and the open session, or the newest if none is open. */
  readSessions() {
    return this.#reads.read("sessions", async () => {
      const wanted = this.#wanted;
      const sessions = /** @type {SessionSummary[]} */ (await request("GET", "/calibration_sessions"));
      this.#store.set({ sessions });
      if (this.#wanted !== wanted) return; // another session was opened meanwhile, and is being read
      const open = this.#wanted ?? this.#store.state.session?.id;
      const id = sessions.find((each) => each.id === open)?.id ?? sessions[0]?.id;
      this.#wanted = id ?? null;
      if (id) await this.#load(id);
      else this.#store.set({ session: null });
    });
  }

  /** Show a new session. @param {SessionDocument} session */
  showSession(session) {
    this.#wanted = session.id;
    this.#store.set({ session });
    return this.readSessions();
  }

  /** @param {string} id */
  openSession(id) {
    this.#wanted = id;
    return this.#reads.read(`session ${id}`, () => this.#load(id));
  }

  /** @param {string} id */
  async #load(id) {
    const session = /** @type {SessionDocument} */ (await request("GET", `/calibration_sessions/${id}`));
    if (this.#wanted === null || this.#wanted === id) this.#store.set({ session });
  }

  /** Read the pan-tilt now and repeatedly while a page shows it: no event reports its motion. */
  readPanTilt() {
    const read = async () => {
      if (!document.hidden)
        this.#store.set({ pan_tilt: /** @type {PanTiltDocument} */ (await request("GET", "/pan_tilt")) });
    };
    return this.#reads.repeat("pan_tilt", read, () => {
      const { wizard, rig_page, acceptance_page, pan_tilt } = this.#store.state;
      return wizard || rig_page || acceptance_page ? (pan_tilt?.moving ? MOVING_MS : RESTING_MS) : null;
    });
  }

  /** Read the displays now and repeatedly while the page is open: there is no event for one that went silent. */
  readDisplays() {
    const read = async () => {
      const [displays, display_pattern] = await Promise.all([
        /** @type {Promise<DisplayDocument[]>} */ (request("GET", "/displays")),
        /** @type {Promise<PatternDocument>} */ (request("GET", "/displays/pattern")),
      ]);
      this.#store.set({ displays, display_pattern });
    };
    return this.#reads.repeat("displays", read, () => (this.#store.state.wizard ? DISPLAYS_MS : null));
  }

  /** @param {EventDocument} event */
  onEvent(event) {
    const data = event.data ?? {};
    this.#work.onEvent(event);
    if (event.kind === "calibration.health") void this.readHealth();
    if (event.kind === "rig.calibration") void this.readAll();
    if (event.kind === "calibration.acceptance" && this.#store.state.acceptance_page) void this.#readAcceptances();
    if (!this.#store.state.wizard) return;
    if (/^display\./.test(event.kind)) void this.readDisplays();
    if (event.kind === "calibration.pose") this.#pose(data);
    if (event.kind === "calibration.fitted") void this.readAll();
    if (/^rig\.(settle_time|state)$/.test(event.kind)) void this.readSettleTime();
    const open = this.#wanted; // also while it is being read
    if (open && data["session_id"] === open && /^calibration\.(pose|sample|progress)$/.test(event.kind)) {
      this.#later ??= setTimeout(() => {
        this.#later = undefined;
        if (this.#wanted) void this.openSession(this.#wanted);
      }, SESSION_MS);
    }
  }

  /**
   * Show the result of a pose at once; the reasons follow with the session's document.
   * @param {Record<string, unknown>} data
   */
  #pose(data) {
    const { session } = this.#store.state;
    if (!session || session.id !== data["session_id"]) return;
    const sweeps = session.sweeps.map((sweep) =>
      sweep.station !== data["station"]
        ? sweep
        : {
            ...sweep,
            poses: sweep.poses.map((pose) =>
              pose.index !== data["index"]
                ? pose
                : {
                    ...pose,
                    left: state(data["left"], pose.left),
                    right: state(data["right"], pose.right),
                  },
            ),
          },
    );
    this.#store.set({ session: { ...session, sweeps } });
  }
}

/** @param {unknown} word @param {NodeState} before @returns {NodeState} */
function state(word, before) {
  return word === "centred" || word === "rim" || word === "refused" || word === "waiting" ? word : before;
}
