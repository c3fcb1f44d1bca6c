// Sends the operator's commands. Clicks are sent in their order, and the stop waits for nothing.

import { outcome, RequestError, SIGNED_OUT, request } from "./transport/api.js";
import { Deletions } from "./deletions.js";
import { NO_LEASE, holderName } from "./operating/lease/words.js";

/**
 * @import { DepthDocument, FixationDocument, FixationRequest, JobDocument } from "#api"
 * @import { LeaseDocument, StopDocument } from "#api"
 * @import { Point, Store } from "#console"
 * @import { Fixations } from "./looking/fixations.js"
 * @import { Toasts } from "./elements/toasts.js"
 */

/** The commands of one page. */
export class Commands {
  #store;
  #toasts;
  #fixations;
  /** @type {Promise<unknown>} */
  #queue = Promise.resolve();
  #deletions;

  /** @param {{store: Store, toasts: Toasts, fixations: Fixations}} context */
  constructor({ store, toasts, fixations }) {
    this.#store = store;
    this.#toasts = toasts;
    this.#fixations = fixations;
    this.#deletions = new Deletions({
      commands: this,
      resource: "/targets",
      changed: (hidden_targets, gone) =>
        store.set({ hidden_targets, targets: (store.state.targets ?? []).filter(({ id }) => id !== gone) }),
    });
  }

  /**
   * Run an action; show its problem and return null when it fails.
   * @template T
   * @param {() => Promise<T>} act
   * @returns {Promise<T | null>}
   */
  async attempt(act) {
    const { answer, error } = await outcome(act());
    if (error) this.#show(error);
    return answer;
  }

  /**
   * Send a command with the lease; return its answer, or its error, which is shown as a message only if `shows` returns
   * true, with what takes the message away.
   * @template T
   * @param {"POST" | "PUT" | "PATCH" | "DELETE"} method
   * @param {string} path
   * @param {import("./transport/api.js").Options & {shows: (error: RequestError) => boolean}} options
   */
  async tried(method, path, { shows, ...options }) {
    const asked = /** @type {Promise<T>} */ (request(method, path, { ...options, headers: this.leaseHeader() }));
    const found = await outcome(asked);
    const dismiss = found.error && shows(found.error) ? this.#show(found.error) : () => {};
    return { ...found, dismiss };
  }

  /** Show an error; return what takes it away. @param {RequestError} error */
  #show(error) {
    return error.slug === SIGNED_OUT ? () => {} : this.#toasts.problem(error.document, this.#wayOut(error));
  }

  /**
   * Send a command with the lease; show its problem and return null when it fails.
   * @template T
   * @param {"POST" | "PUT" | "PATCH" | "DELETE"} method
   * @param {string} path
   * @param {import("./transport/api.js").Options} [options]
   * @returns {Promise<T | null>} true where the response has no body
   */
  send(method, path, options = {}) {
    const headers = this.leaseHeader();
    return this.attempt(async () => (await request(method, path, { ...options, headers })) ?? /** @type {T} */ (true));
  }

  /** @param {import("./elements/toasts.js").Message} message */
  notify(message) {
    return this.#toasts.show(message);
  }

  /** Return the button that resolves a refusal, or null when no single button does. @param {RequestError} error */
  #wayOut(error) {
    const { lease, lease_token } = this.#store.state;
    if (error.slug === "stopped") return { label: "Release the stop", act: () => this.releaseStop() };
    const newest = this.#store.state.targets?.[0];
    if (error.slug === "stale-view" && newest)
      return { label: `Look at “${newest.label}” again`, act: () => this.lookAgain(newest.id) };
    const held = error.slug === "busy" && lease?.holder && !lease_token && error.message.includes(lease.holder);
    return held
      ? lease.person
        ? { label: `Ask ${lease.holder} for control`, act: () => this.askLease(holderName(this.#store.state.sign_in)) }
        : { label: `Take control over from ${lease.holder}`, act: () => this.takeLease("operator", true) }
      : null;
  }

  /**
   * Fixate a pixel, a rectangle or a direction; return whether the server took the order. Orders reach it one after the
   * other.
   * @param {FixationRequest} body
   */
  fixate(body) {
    return this.#inTurn(() => this.#post("/fixations", body, body));
  }

  /**
   * Fixate the same target again, nearer or farther than its answer.
   * @param {FixationDocument} fixation
   * @param {"nearer" | "farther"} direction
   */
  correct(fixation, direction) {
    return this.#inTurn(() => this.#post(`/fixations/${fixation.id}/corrections`, { direction }, fixation.request));
  }

  /**
   * Choose one of the alternatives as the answer, and point both eyes there.
   * @param {FixationDocument} fixation
   * @param {number} alternative
   */
  async choose(fixation, alternative) {
    const path = `/fixations/${fixation.id}/choice`;
    const answer = /** @type {FixationDocument | null} */ (await this.send("POST", path, { body: { alternative } }));
    if (!answer) return;
    this.#fixations.changed(answer);
    const { ax_deg, ay_deg } = answer.target;
    const body = { direction: { ax_deg, ay_deg }, distance_m: answer.alternatives[alternative]?.distance_m ?? null };
    await this.send("POST", "/mirrors/steer", { body });
  }

  /** @param {string} target_id */
  lookAgain(target_id) {
    const target = this.#store.state.targets?.find(({ id }) => id === target_id);
    const there = target ? { direction: { ax_deg: target.ax_deg, ay_deg: target.ay_deg } } : null;
    return this.#inTurn(() => this.#post(`/targets/${target_id}/fixate`, undefined, there));
  }

  /** Send an order after those before it, whatever became of them. @param {() => Promise<boolean>} send */
  #inTurn(send) {
    const order = this.#queue.then(send);
    this.#queue = order.catch(() => null);
    return order;
  }

  /**
   * @param {string} path
   * @param {FixationRequest | {direction: "nearer" | "farther"} | undefined} body
   * @param {FixationRequest | null} shown
   */
  async #post(path, body, shown) {
    this.#fixations.sending(shown);
    const job = /** @type {JobDocument | null} */ (await this.send("POST", path, { body }));
    if (job) this.#fixations.follow(job, shown, true);
    else this.#fixations.refused();
    return job !== null;
  }

  /** Cancel the running fixation. */
  cancel() {
    const current = this.#store.state.current;
    if (!current?.job_id || !this.#fixations.running) return Promise.resolve(null);
    return this.send("POST", `/jobs/${current.job_id}/cancel`);
  }

  /** Park the mirrors at once, without queue or lease. */
  async stop() {
    const options = { patience_ms: 5000, keepalive: true };
    const answer = /** @type {import("#api").StopAnswer | null} */ (await this.send("POST", "/stop", options));
    if (!answer) return;
    this.#store.set({ stop: { by: null, since_utc: null, ...this.#store.state.stop, ...answer } });
    if (answer.parked === false) {
      this.#toasts.show({
        tone: "warn",
        title: "Stop engaged, but the mirrors did not confirm",
        detail: "Nothing moves them from here until it is released. See the rig's status.",
      });
    }
  }

  async releaseStop() {
    const answer = /** @type {StopDocument | null} */ (await this.send("DELETE", "/stop"));
    const stop = answer ?? (await this.attempt(() => /** @type {Promise<StopDocument>} */ (request("GET", "/stop"))));
    if (stop) this.#store.set({ stop });
  }

  /**
   * Return the newest depth at a wide pixel, or the reason why there is none.
   * @param {Point} pixel
   * @returns {Promise<DepthDocument | string>}
   */
  async depthAt(pixel) {
    const path = `/depth?x_px=${pixel.x.toFixed(3)}&y_px=${pixel.y.toFixed(3)}`;
    const { answer, error } = await outcome(/** @type {Promise<DepthDocument>} */ (request("GET", path)));
    return answer ?? (error?.slug === "not-found" ? "no fovea has looked here" : (error?.message ?? ""));
  }

  /** @param {string} id @param {string} label */
  rename(id, label) {
    return this.send("PATCH", `/targets/${id}`, { body: { label } });
  }

  /** Hide a target; it is deleted when the time to undo is over. @param {{id: string, label: string}} target */
  remove(target) {
    this.#deletions.add(target);
  }

  /** @param {string} holder @param {boolean} take_over @param {string | null} [reason] why it is taken over from a person */
  async takeLease(holder, take_over, reason = null) {
    const body = { holder, take_over, ...(reason === null ? {} : { reason }) };
    this.#store.set({ lease_asked: false });
    const lease = /** @type {import("#api").LeaseGrant | null} */ (await this.send("POST", "/lease", { body }));
    if (lease?.token)
      this.#keepToken(lease.token, { ...NO_LEASE, holder: lease.holder, expires_in_s: lease.expires_in_s });
  }

  /** Ask the holder for the lease; it is taken when it is handed over. @param {string} holder */
  async askLease(holder) {
    const lease = /** @type {LeaseDocument | null} */ (await this.send("POST", "/lease/request", { body: { holder } }));
    if (lease) this.#store.set({ lease, lease_asked: true });
  }

  /** Hand the lease over to who asks for it, or keep it. @param {boolean} hand_over */
  async answerLease(hand_over) {
    const lease = /** @type {LeaseDocument | null} */ (
      await this.send("PUT", "/lease/request", { body: { hand_over } })
    );
    if (lease) this.#keepToken(hand_over ? null : this.#store.state.lease_token, lease);
  }

  async giveLease() {
    await this.send("DELETE", "/lease");
    this.#keepToken(null, NO_LEASE);
  }

  /** Renew the lease; drop it when the server reports it lost. */
  async renewLease() {
    if (!this.#store.state.lease_token) return;
    try {
      await request("PUT", "/lease", { headers: this.leaseHeader() });
    } catch (error) {
      if (!(error instanceof RequestError) || ["offline", SIGNED_OUT].includes(error.slug)) return;
      this.#keepToken(null, null);
      this.#toasts.show({ tone: "warn", title: "Control was lost", detail: error.message });
    }
  }

  /** @param {string | null} token @param {LeaseDocument | null} lease */
  #keepToken(token, lease) {
    this.#store.set(lease ? { lease_token: token, lease } : { lease_token: token });
    if (token) sessionStorage.setItem("foveacam.lease", token);
    else sessionStorage.removeItem("foveacam.lease");
  }

  notifyNoCalibration() {
    this.#toasts.show({
      tone: "warn",
      title: "Steering needs a calibration",
      detail: "Without one the direction of a pixel is not known. Load or make a calibration of this rig.",
    });
  }

  /** Return the header that a command needs to move anything. @returns {Record<string, string>} */
  leaseHeader() {
    const token = this.#store.state.lease_token;
    return token ? { "X-Lease": token } : {};
  }
}
