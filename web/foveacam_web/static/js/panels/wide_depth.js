// Shows in the head of the 3D pane how much of the wide view's depth is known, and the button that starts a survey.

import { RequestError, request } from "../transport/api.js";
import { fill, h } from "../elements/dom.js";
import { sentence } from "../elements/format.js";
import { hasEnded, JobFollower } from "../transport/jobs.js";
import { QuietReads } from "../transport/quiet.js";
import { API } from "../root.js";

/**
 * @import { EventDocument, JobDocument, WideDepthDocument } from "#api"
 * @import { Commands, Job, Store } from "#console"
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
  #survey = new JobFollower({ ours: ({ kind }) => kind === KIND, news: (job) => this.#take(job) });
  #asked = false;
  /** Id of the calibration whose depth was read; empty where it has to be read with the next news of the rig. */
  #calibration = "";
  #words = h("a", {
    class: "wide-depth-known",
    href: `${API}/wide_depth.png`,
    target: "_blank",
    rel: "noopener",
    on: { click: showView },
  });
  #button = h("button", { type: "button", class: "plain wide-depth-look", on: { click: () => void this.press() } });
  #status = h("span", { class: "unseen", role: "status" });

  /** @param {{store: Store, commands: Commands}} context */
  constructor({ store, commands }) {
    this.#store = store;
    this.#commands = commands;
    this.element = h("span", { class: "wide-depth" }, this.#words, this.#button, this.#status);
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
        this.#known = null; // not calibrated: there is nothing to ask for
        this.#survey.forget();
        return this.#draw();
      }
      try {
        this.#known = /** @type {WideDepthDocument} */ (await request("GET", "/wide_depth"));
        if (this.#known.survey_job_id) this.#survey.expect(this.#known.survey_job_id);
        if (this.#survey.running) await this.#survey.readAll();
      } catch (error) {
        if (!(error instanceof RequestError)) throw error;
        this.#known = null;
        if (error.slug === "not-connected") this.#calibration = ""; // a server that has come back opens its rig
      }
      this.#draw();
    });
  }

  /** @param {EventDocument} event */
  onEvent(event) {
    const { kind, data } = event;
    this.#survey.onEvent(event);
    if (kind.startsWith("calibration.")) void this.readAll();
    if (kind !== "wide_depth.changed") return;
    this.#known = /** @type {WideDepthDocument} */ (/** @type {unknown} */ (data));
    this.#draw();
  }

  /** @param {Job} job */
  #take({ state, problem }) {
    this.#draw();
    if (!hasEnded(state)) return;
    if (state === "failed")
      this.#commands.notify({ tone: "bad", title: "The look around has failed", detail: problem?.detail ?? "" });
    this.#status.textContent = state === "succeeded" ? "The look around is done" : "The look around has ended early";
    void this.readAll();
  }

  async press() {
    if (this.#asked) return;
    this.#asked = true;
    if (this.#survey.running) await this.#survey.cancel(this.#commands);
    else {
      const job = /** @type {JobDocument | null} */ (await this.#commands.send("POST", "/wide_depth/surveys"));
      if (job) this.#survey.follow(job);
    }
    this.#asked = false;
    this.#draw();
  }

  #draw() {
    const known = this.#known;
    const share = known ? Math.round(100 * known.known_fraction) : 0;
    this.#words.hidden = !known || known.known_cells === 0;
    this.#words.textContent = `Depth known in ${share} % of the view`;
    this.#words.title = known
      ? `Depth is known in ${share} % of the wide view${spanWords(known)}. Show it in colours`
      : "";
    const { running, job } = this.#survey;
    const done = job?.progress?.total ? `${job.progress.done} %` : "waiting";
    const why = sentence(job?.progress?.note);
    fill(this.#button, running ? `Cancel (${done})` : "Look around");
    this.#button.title = running ? `End the look around; what it has found stays. ${why}`.trim() : TITLE;
    this.#button.disabled =
      !running && (this.#store.state.stop?.engaged === true || !this.#store.state.rig?.calibration);
  }
}

/** Show the depth as a view of this page, unless a tab of its own is asked for. @param {MouseEvent} event */
function showView(event) {
  const tab = document.getElementById("tab-wide_depth");
  if (!tab || event.ctrlKey || event.metaKey || event.shiftKey) return;
  event.preventDefault();
  tab.click();
  document.querySelector(".derived")?.scrollIntoView({ block: "nearest" });
}

/** @param {WideDepthDocument} known */
function spanWords({ nearest_m, farthest_m }) {
  return nearest_m === null || farthest_m === null
    ? ""
    : `, from ${nearest_m.toFixed(1)} to ${farthest_m.toFixed(1)} m`;
}
