// What the pages that show views without the console's panels share: views, commands, keys, STOP, and following the server.

import { Commands } from "../commands.js";
import { need } from "../elements/dom.js";
import { Fixations } from "../looking/fixations.js";
import { FollowOrders } from "../looking/follow/orders.js";
import { FollowReader } from "../looking/follow/reader.js";
import { Keyboard } from "../keys.js";
import { LoopOrders } from "../looking/loop/orders.js";
import { mountOffline, mountStop } from "../panels/stop_button.js";
import { keepOnTop } from "../panels/stop_on_top.js";
import { changeSettings } from "../settings.js";
import { watchSignIn } from "../operating/session/signed_out.js";
import { Steering } from "../looking/steer/steering.js";
import { createStore } from "../state.js";
import { Sync } from "../transport/sync.js";
import { exposeHooks } from "../testhooks.js";
import { Toasts } from "../elements/toasts.js";
import { equipDerived } from "./derived_tools.js";
import { ReachReader } from "./reach_reader.js";
import { Views } from "./views.js";

/** Build the views and what they need; the page places the panes. */
export function openViewsPage() {
  const store = createStore();
  const toasts = new Toasts();
  const fixations = new Fixations(store);
  const commands = new Commands({ store, toasts, fixations });
  const follows = new FollowOrders({ store, commands });
  const sync = new Sync({ store, fixations, others: [new FollowReader({ store, commands })] });
  const views = new Views({
    store,
    commands,
    follows,
    loop: new LoopOrders({ store, commands }),
    steering: new Steering({ store }),
    onBoot: () => void sync.readAll(),
  });
  equipDerived(views, commands);
  document.body.append(toasts.element);
  mountStop(need("stop"), need("stopped"), { store, commands });
  keepOnTop(need("stop"));
  mountOffline(need("offline"), store);
  const keyboard = new Keyboard({
    stop: () => void commands.stop(),
    escape: () => {
      if (views.shrinkAll() || follows.end()) return;
      views.wide.abandon();
      void commands.cancel();
    },
    letters: () => store.state.settings.single_keys,
    keys: {
      i: () => changeSettings(store, { readout: !store.state.settings.readout }),
      f: () => changeSettings(store, { footprints: !store.state.settings.footprints }),
      t: () => follows.toggle(),
      d: () => void views.wide.probe(),
      "+": () => views.wide.zoom(1.5),
      "=": () => views.wide.zoom(1.5),
      "-": () => views.wide.zoom(1 / 1.5),
      0: () => views.wide.fit(),
    },
  });
  watchSignIn(store);
  sync.followAll();
  new ReachReader(store);
  exposeHooks({ store, views });
  return { store, views, keyboard };
}
