// Starts the page of a window that shows panes of a recording, which its address names: `#ID:layout`. The recording's
// page in the gallery plays it; this window follows.

import { RequestError, request } from "./transport/api.js";
import { decoded, galleryAddress } from "./addresses.js";
import { Commands } from "./commands.js";
import { html, need, update } from "./elements/dom.js";
import { Fixations } from "./looking/fixations.js";
import { sentence } from "./elements/format.js";
import { recordingPath } from "./capturing/gallery/recording_words.js";
import { Keyboard } from "./keys.js";
import { mountOffline, mountStop } from "./panels/stop_button.js";
import { keepOnTop } from "./panels/stop_on_top.js";
import { followPlayer } from "./capturing/replay/link.js";
import { ReplayPanes } from "./capturing/replay/panes.js";
import { titleOf } from "./capturing/replay/slot.js";
import { isShowable } from "./capturing/replay/stereo.js";
import { watchSignIn } from "./operating/session/signed_out.js";
import { createStore } from "./state.js";
import { Sync } from "./transport/sync.js";
import { Toasts } from "./elements/toasts.js";
import { layoutOf, layoutText } from "./operating/windows/layout.js";

/** @import { RecordingDocument, TimelineDocument, TracksDocument } from "#api" */

const KEYS = ["ArrowLeft", "ArrowRight", "Home", "End", "k", "a", "b", "v", ",", "."];

const store = createStore();
const toasts = new Toasts();
const fixations = new Fixations(store);
const commands = new Commands({ store, toasts, fixations });
document.body.append(toasts.element);
mountStop(need("stop"), need("stopped"), { store, commands });
keepOnTop(need("stop"));
mountOffline(need("offline"), store);
new Keyboard({
  stop: () => void commands.stop(),
  escape: () => {},
  letters: () => store.state.settings.single_keys,
  keys: {},
});
watchSignIn(store);
new Sync({ store, fixations, others: [] }).followAll();
void open();

async function open() {
  const [id = "", text = ""] = (decoded(location.hash.slice(1)) ?? "").split(/:(.*)/s);
  try {
    const read = (/** @type {string} */ part) => request("GET", recordingPath(id, part), { patience_ms: 60_000 });
    const [recording, timeline, tracks] = await Promise.all([read(""), read("/timeline"), read("/tracks")]);
    show(/** @type {RecordingDocument} */ (recording), text, {
      id,
      timeline: /** @type {TimelineDocument} */ (timeline),
      tracks: /** @type {TracksDocument} */ (tracks),
    });
  } catch (error) {
    if (!(error instanceof RequestError)) throw error;
    say(sentence(error.message));
  }
}

/** @param {RecordingDocument} recording @param {string} text the layout @param {import("./capturing/replay/panes.js").Replayed} replayed */
function show({ id, name }, text, replayed) {
  const layout = layoutOf(text);
  const panes = new ReplayPanes(need("panes"), replayed, {
    keep: {
      read: () => (isShowable(layout) ? layout : null),
      write: (changed) => history.replaceState(null, "", `#${encodeURIComponent(id)}:${layoutText(changed)}`),
      shown: (sources) => (document.title = `${sources.map(titleOf).join(", ")} of ${name}: FoveaCam Duo`),
    },
    aside: () => null,
    signal: new AbortController().signal,
  });
  const player = followPlayer(id, {
    show: (now) => panes.show(now),
    lost: (gone) => say(gone ? "The player of this recording is closed:" : "", id),
  });
  document.addEventListener("keydown", (event) => {
    const { key, shiftKey, target } = event;
    if (event.ctrlKey || event.metaKey || event.altKey || !KEYS.includes(key.length > 1 ? key : key.toLowerCase()))
      return;
    if (target instanceof Element && target.closest("select, .divider")) return;
    event.preventDefault();
    player.press({ key, shift: shiftKey });
  });
}

/** @param {string} words @param {string} [id] whose player can be opened again */
function say(words, id) {
  const place = need("lost");
  place.hidden = words === "";
  const again =
    id !== undefined && html`<a href=${`/${galleryAddress("recordings", id)}`} target="_blank">open it again</a>`;
  update(place, html`<span>${words} ${again}</span>`);
}
