// Shows in the head of the 3D pane how much of the wide view's depth is known, and the button that starts a survey.

import { RequestError, request } from "../transport/api.js";
import { fill, h } from "../elements/dom.js";
import { hasEnded } from "../transport/jobs.js";
import { QuietReads } from "../transport/quiet.js";
import { API } from "../root.js";

/**
 * @import { EventDocument, JobDocument, WideDepthDocument } from "#api"
 * @import { Commands } from "../commands.js"
 * @import { Store } from "../store.js"
 */

const KIND = "wide_depth_survey";
const TITLE = "Look at the whole field once, so that its depth is known: in the 3D pane, and for later clicks";

/** The wide depth and its survey as one page knows them. */
export class WideDepth {
  #store;
  #commands;
  #reads = new QuietReads();
  /** @type {WideDepthDocument | null} */
  #known = null;
  /** @type {JobDocument | null} */
  #job = null;
  #asked = false;
  /** Id of the calibration whose depth was read; empty where it has to be read with the next news of the rig. */
  #calibration = "";
  #words = h("a", { class: "wide-depth-known", href: `${API}/wide_depth.png`, target: "_blank", rel: "noopener" });
  #button = h("button", { type: "button", class: "plain wide-depth-look", on: { click: () => void this.#press() } });
  #said = h("span", { class: "unseen", role: "status" });

  /** @param {{store: Store, commands: Commands}} context */
  constructor({ store, commands }) {
    this.#store = store;
    this.#commands = commands;
    this.element = h("span", { class: "wide-depth" }, this.#words, this.#button, this.#said);
    store.on(["stop", "rig"], ({ rig }) => {
      const now = rig?.calibration?.id ?? "";
      const changed = now !== this.#calibration;
      this.#calibration = now;
      if (changed) void this.readAll();
      else this.#draw();
    });
  }

  readAll() {
    return this.#reads.read("wide_depth", async () => {
      if (!this.#store.state.rig?.calibration) {
        this.#known = this.#job = null; // not calibrated: there is nothing to ask for
        return this.#draw();
      }
      try {
        this.#known = /** @type {WideDepthDocument} */ (await request("GET", "/wide_depth"));
        const id = this.#known.survey_job_id;
        this.#job = id ? /** @type {JobDocument} */ (await request("GET", `/jobs/${id}`)) : null;
      } catch (error) {
        if (!(error instanceof RequestError)) throw error;
        this.#known = this.#job = null;
        if (error.slug === "not-connected") this.#calibration = ""; // a server that has come back opens its rig
      }
      this.#draw();
    });
  }

  /** @param {EventDocument} event */
  hear({ kind, data }) {
    if (kind === "wide_depth.changed") this.#known = /** @type {WideDepthDocument} */ (/** @type {unknown} */ (data));
    else if (kind === "job.updated" && data?.["kind"] === KIND)
      this.#follow(/** @type {JobDocument} */ (/** @type {unknown} */ (data)));
    else {
      if (kind.startsWith("calibration.")) void this.readAll();
      return;
    }
    this.#draw();
  }

  /** @param {JobDocument} job */
  #follow(job) {
    const ended = hasEnded(job.state);
    this.#job = ended ? null : job;
    if (!ended) return;
    if (job.state === "failed")
      this.#commands.say({ tone: "bad", title: "The look around has failed", detail: job.problem?.detail ?? "" });
    this.#said.textContent = job.state === "succeeded" ? "The look around is done" : "The look around has ended early";
    void this.readAll();
  }

  async #press() {
    if (this.#asked) return;
    this.#asked = true;
    const job = this.#job;
    const answer = await this.#commands.send("POST", job ? `/jobs/${job.id}/cancel` : "/wide_depth/surveys");
    this.#asked = false;
    if (answer && !job) this.#job = this.#job ?? /** @type {JobDocument} */ (answer);
    this.#draw();
  }

  #draw() {
    const known = this.#known;
    const share = known ? Math.round(100 * known.known_fraction) : 0;
    this.#words.hidden = !known || known.known_cells === 0;
    this.#words.textContent = `${share} % known`;
    this.#words.title = known
      ? `Depth is known in ${share} % of the wide view${spanWords(known)}. Open it as a picture`
      : "";
    const progress = this.#job?.progress;
    const done = progress?.total ? `${progress.done} of ${progress.total}` : "waiting";
    fill(this.#button, this.#job ? `Cancel (${done})` : "Look around");
    this.#button.title = this.#job ? "End the look around; what it has found stays" : TITLE;
    this.#button.disabled =
      !this.#job && (this.#store.state.stop?.engaged === true || !this.#store.state.rig?.calibration);
  }
}

/** @param {WideDepthDocument} known */
function spanWords({ nearest_m, farthest_m }) {
  return nearest_m === null || farthest_m === null
    ? ""
    : `, from ${nearest_m.toFixed(1)} to ${farthest_m.toFixed(1)} m`;
}
