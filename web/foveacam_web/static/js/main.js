// Begins the console: the live views, STOP and its key; the rest (console.js) once there is a picture, so that on a slow
// line the picture waits for nothing else.

import { pagesAt } from "./addresses.js";
import { Commands } from "./commands.js";
import { need } from "./elements/dom.js";
import { Toasts } from "./elements/toasts.js";
import { Fixations } from "./looking/fixations.js";
import { FollowOrders } from "./looking/follow/orders.js";
import { Keyboard } from "./keys.js";
import { LoopOrders } from "./looking/loop/orders.js";
import { mountOffline, mountStop } from "./panels/stop_button.js";
import { createStore } from "./state.js";
import { Steering } from "./looking/steer/steering.js";
import { Views } from "./video/views.js";

const LONGEST_WAIT_MS = 3000; // for a first picture that the server has

export const store = createStore();
export const toasts = new Toasts();
export const fixations = new Fixations(store);
export const commands = new Commands({ store, toasts, fixations });
export const followOrders = new FollowOrders({ store, commands });
export const loopOrders = new LoopOrders({ store, commands });
export const steering = new Steering({ store });
/** What the rest of the console sets. */
export const begun = { booted: () => {} };
/** What keys do: the rest of the console adds its own. @type {import("./keys.js").Actions} */
export const actions = {
  stop: () => void commands.stop(),
  escape: () => void views.shrinkAll(),
  letters: () => store.state.settings.single_keys,
  keys: {},
};
export const views = new Views({
  store,
  commands,
  follows: followOrders,
  loop: loopOrders,
  steering,
  onBoot: () => begun.booted(),
});
export const keyboard = new Keyboard(actions);

document.body.append(toasts.element);
need("wide").replaceChildren(views.pane("wide").element);
need("eyes").replaceChildren(views.pane("left").element, views.pane("right").element);
mountStop(need("stop"), need("stopped"), { store, commands });
mountOffline(need("offline"), store);
void complete();

/** Load the rest of the console: at once where the address names one of its pages, else after the first picture. */
async function complete() {
  if (!Object.values(pagesAt(location.hash)).some(Boolean)) await firstPicture();
  try {
    await Promise.all([laterStyles(), import("./console.js")]);
  } catch (error) {
    toasts.show({
      tone: "bad",
      title: "The panels were not loaded",
      detail: "The server did not answer, or it was updated. The views and STOP work.",
      action: { label: "Load again", act: () => location.reload() },
      stay_ms: 3_600_000,
    });
    throw error;
  }
}

/** Fetch the style sheets of the panels and pages. */
async function laterStyles() {
  const { content } = /** @type {HTMLTemplateElement} */ (need("later-styles"));
  const links = [...content.querySelectorAll("link")];
  const loaded = links.map((link) => {
    return new Promise((resolve, reject) => {
      link.addEventListener("load", resolve);
      link.addEventListener("error", reject);
    });
  });
  document.head.append(content);
  await Promise.all(loaded);
}

/** Return when a view has shown its first picture, or when the server has none, or cannot be reached. */
async function firstPicture() {
  const shown = store.until(["shown"], (state) => Object.values(state.shown).some(({ count }) => count > 0));
  const keys = /** @type {("stream" | "server_stats")[]} */ (["stream", "server_stats"]);
  const { server_stats } = await store.until(keys, (state) => state.stream === "down" || hasReported(state));
  if (document.hidden || Object.values(server_stats).every(({ age_ms }) => age_ms === null)) return;
  await Promise.race([shown, new Promise((resolve) => setTimeout(resolve, LONGEST_WAIT_MS))]);
}

/** Return whether the server has reported how old its pictures are. @param {import("#page").ConsoleState} state */
function hasReported({ server_stats }) {
  return Object.keys(server_stats).length > 0;
}
