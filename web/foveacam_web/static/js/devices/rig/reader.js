// Keeps the rig page's state equal to the server's: once a second while it is open, and at each event.

import { remedyOf } from "../../elements/format.js";
import { request } from "../../transport/api.js";
import { hasEnded, JobFollower } from "../../transport/jobs.js";
import { QuietReads } from "../../transport/quiet.js";

/**
 * @import { EventDocument, RailDocument, SimulatedFaults } from "#api"
 * @import { Commands, Job, Store } from "#console"
 */

const READ_BACK_MS = 1000;
const MOVING_MS = 350;
const RESTING_MS = 1500;

/** The reads of one page. */
export class RigReader {
  #store;
  #pan_tilt;
  #commands;
  #reads = new QuietReads();
  /** Follows the self-test of the triggers, begun by this or any other client. */
  tests = new JobFollower({ ours: ({ kind }) => kind === "camera.self_test", news: (job) => this.#test(job) });
  /** How many answers to orders have shown the faults. */
  #faults_set = 0;
  /** Read the rig's document. */
  readRig = () => Promise.resolve();

  /** @param {{store: Store, commands: Commands, pan_tilt: {readPanTilt(): Promise<void>}}} context */
  constructor({ store, commands, pan_tilt }) {
    this.#store = store;
    this.#commands = commands;
    this.#pan_tilt = pan_tilt;
    store.on(["rig_page"], ({ rig_page }) => rig_page && void this.readAll());
    store.on(["rig"], ({ rig_page, faults }) => rig_page && !faults && void this.readFaults());
    setInterval(() => this.#shows && store.state.stream === "open" && void this.readRig(), READ_BACK_MS);
  }

  get #shows() {
    return this.#store.state.rig_page && !document.hidden;
  }

  async readAll() {
    if (!this.#store.state.rig_page) return;
    await Promise.all([
      this.readRig(),
      this.readRail(),
      this.#pan_tilt.readPanTilt(),
      this.readTest(),
      this.#reads.read("running test", () => this.tests.readAll()),
      this.readFaults(),
    ]);
  }

  /** Show how far the self-test of the triggers is; at its end what it found, or why it failed. @param {Job} job */
  #test(job) {
    const { state, problem } = job;
    const over = hasEnded(state);
    this.#store.set({ running_test: over ? null : job });
    if (!over) return;
    if (state === "failed") {
      const detail = problem?.detail ?? "";
      this.#commands.notify({ tone: "bad", title: "The trigger test failed", detail, remedy: remedyOf(problem) });
    }
    void this.readTest();
    void this.readRig();
  }

  readTest() {
    return this.#reads.keep(this.#store, "trigger_test", "/cameras/self_tests/newest");
  }

  /** Read the simulated faults; a real rig has none. */
  async readFaults() {
    if (!this.#store.state.rig?.simulated) return;
    await this.#reads.read("faults", async () => {
      const before = this.#faults_set;
      const faults = /** @type {SimulatedFaults} */ (await request("GET", "/simulation/faults"));
      if (before === this.#faults_set) this.#store.set({ faults });
    });
  }

  /** Show the faults that an order has set; what is being read meanwhile may be older. @param {SimulatedFaults} faults */
  showFaults(faults) {
    this.#faults_set += 1;
    this.#store.set({ faults });
  }

  /** Read the rail now and repeatedly while the page is open: no event reports its position. */
  readRail() {
    const read = async () => {
      if (!document.hidden) this.#store.set({ rail: /** @type {RailDocument} */ (await request("GET", "/rail")) });
    };
    return this.#reads.repeat("rail", read, () => {
      const { rig_page, rail } = this.#store.state;
      return rig_page ? (rail?.moving ? MOVING_MS : RESTING_MS) : null;
    });
  }

  /** @param {EventDocument} event */
  onEvent(event) {
    if (!this.#store.state.rig_page) return;
    this.tests.onEvent(event);
    if (event.kind === "camera.self_test") void this.readTest();
    if (event.kind === "simulation.faults") void this.readFaults();
    if (event.kind.startsWith("rail.")) void this.readRail();
  }
}
