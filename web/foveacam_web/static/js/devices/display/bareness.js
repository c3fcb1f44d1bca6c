// Shows the pattern alone: full screen where the browser can, nothing over the pattern, and a screen that stays awake.

/** Whether the pattern stands alone; a tap or Escape ends it. */
export class Bareness {
  #root;
  #on = false;
  /** @type {WakeLockSentinel | null} */
  #awake = null;

  /** @param {HTMLElement} root */
  constructor(root) {
    this.#root = root;
    document.addEventListener("fullscreenchange", () => document.fullscreenElement || this.#end());
    document.addEventListener("visibilitychange", () => void this.#keepAwake()); // a hidden page loses its lock
    document.addEventListener("click", (event) => {
      if (this.#on && !(event.target instanceof Element && event.target.closest("#bar"))) this.#leave();
    });
    document.addEventListener("keydown", (event) => {
      if (this.#on && event.key === "Escape") this.#leave();
    });
  }

  async begin() {
    this.#on = true;
    document.body.classList.add("bare");
    await this.#root.requestFullscreen?.().catch(() => {}); // a telephone may have none: the bar goes all the same
    await this.#keepAwake();
  }

  #leave() {
    if (document.fullscreenElement) void document.exitFullscreen();
    this.#end();
  }

  #end() {
    this.#on = false;
    document.body.classList.remove("bare");
    void this.#keepAwake();
  }

  async #keepAwake() {
    if (this.#on && !document.hidden && (this.#awake === null || this.#awake.released)) {
      this.#awake = (await navigator.wakeLock?.request("screen").catch(() => null)) ?? null;
    } else if (!this.#on && this.#awake !== null) {
      await this.#awake.release().catch(() => {});
      this.#awake = null;
    }
  }
}
