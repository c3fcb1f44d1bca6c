// Completes the console that main.js has begun: builds every panel and connects them; a page is loaded when it is
// opened first.

import { CONSOLE_ADDRESS } from "./addresses.js";
import { CalibrationOrders } from "./calibrating/calibration/orders.js";
import { CalibrationReader } from "./calibrating/calibration/reader.js";
import { WorkFollower } from "./calibrating/calibration/work.js";
import { CaptureOrders } from "./capturing/capture/orders.js";
import { CaptureReader } from "./capturing/capture/reader.js";
import { StillReader } from "./capturing/capture/still_reader.js";
import { fill, need } from "./elements/dom.js";
import { FaultReader } from "./devices/faults/reader.js";
import { mountFaultTray } from "./devices/faults/tray.js";
import { mountFollowed } from "./looking/follow/panel.js";
import { FollowReader } from "./looking/follow/reader.js";
import { GalleryReader } from "./capturing/gallery/reader.js";
import { LoopReader } from "./looking/loop/reader.js";
import {
  actions,
  begun,
  commands,
  fixations,
  followOrders,
  keyboard,
  loopOrders,
  steering,
  store,
  toasts,
  views,
} from "./main.js";
import { MeasureOrders } from "./looking/measure/orders.js";
import { mountMeasurements } from "./looking/measure/panel.js";
import { MeasureTool } from "./looking/measure/tool.js";
import { makeLease } from "./operating/lease/dialog.js";
import { watchLease } from "./operating/lease/watch.js";
import { makeHelp, makeSettings, makeSteerDistance } from "./panels/dialogs.js";
import { mountEventLog } from "./panels/eventlog.js";
import { mountFixation } from "./panels/fixation.js";
import { FullResolution } from "./panels/full_resolution.js";
import { mountResultStrip } from "./panels/result_strip.js";
import { mountRigStatus } from "./panels/rigstatus.js";
import { mountNavigation } from "./panels/navigation.js";
import { makePalette } from "./panels/palette.js";
import { Scene } from "./panels/scene.js";
import { keepOnTop } from "./panels/stop_on_top.js";
import { mountTargets } from "./panels/targets.js";
import { mountBadges, mountProblems } from "./panels/topbar.js";
import { WideDepth } from "./panels/wide_depth.js";
import { followAddress, openPage, turnPages } from "./pages.js";
import { toolButton } from "./elements/parts.js";
import { Preferences } from "./preferences/reader.js";
import { makeRecordButton } from "./capturing/recording/button.js";
import { LiveRecording } from "./capturing/recording/live.js";
import { RigOrders } from "./devices/rig/orders.js";
import { RigReader } from "./devices/rig/reader.js";
import { mountSession } from "./operating/session/menu.js";
import { SessionReader } from "./operating/session/reader.js";
import { watchSignIn } from "./operating/session/signed_out.js";
import { SetupOrders } from "./devices/setup/orders.js";
import { SetupReader } from "./devices/setup/reader.js";
import { mountStart } from "./devices/setup/start.js";
import { changeSettings } from "./settings.js";
import { GamepadSteering } from "./looking/steer/gamepad.js";
import { Sync } from "./transport/sync.js";
import { connectTabs } from "./elements/tabs.js";
import { exposeHooks } from "./testhooks.js";
import { Tour } from "./panels/tour.js";
import { derivedViews } from "./video/derived.js";
import { equipDerived } from "./video/derived_tools.js";
import { ReachReader } from "./video/reach_reader.js";
import { offerWindows } from "./operating/windows/opener.js";

const LEASE_RENEWAL_MS = 5000;

const work = new WorkFollower(store);
const reader = new CalibrationReader({ store, work });
const orders = new CalibrationOrders({ store, commands, reader, work });
const rigReader = new RigReader({ store, commands, pan_tilt: reader });
const rigOrders = new RigOrders({ store, commands, reader: rigReader });
const setupReader = new SetupReader(store);
const setupOrders = new SetupOrders({ store, commands, reader: setupReader });
const session = new SessionReader({ store, commands });
const preferences = new Preferences({ store, commands });
const galleryReader = new GalleryReader();
const stillReader = new StillReader();
const full = new FullResolution({ store, commands, fixations });
const captureReader = new CaptureReader(store);
const captureOrders = new CaptureOrders({ store, commands, reader: captureReader });
const recording = new LiveRecording({ store, commands });
const followReader = new FollowReader({ store, commands });
const loopReader = new LoopReader({ store, commands, tuning: loopOrders.tuning });
loopOrders.changed = () => void loopReader.readAll();
new GamepadSteering({ store, steering, commands });
const wideDepth = new WideDepth({ store, commands });
const faultReader = new FaultReader({ store, commands });
const measureOrders = new MeasureOrders({ store, commands });
const sync = new Sync({
  store,
  fixations,
  others: [
    session,
    wideDepth,
    measureOrders,
    followReader,
    full.jobs,
    loopReader,
    reader,
    rigReader,
    setupReader,
    preferences,
    captureReader,
    galleryReader,
    stillReader,
    recording,
    faultReader,
  ],
});
rigReader.readRig = () => sync.readRig();
begun.booted = () => void sync.readAll();
new ReachReader(store);
const measure = new MeasureTool({ store, views, orders: measureOrders });
const tour = new Tour(store);
const help = makeHelp({
  tour: () => tour.start(),
  showHints: () => {
    store.set({ hints_asked: true });
    changeSettings(store, { hints: true });
  },
});
const settings = makeSettings(store);
const lease = makeLease({ store, commands });
watchLease({ store, commands });
const faultTray = mountFaultTray(need("faults"), { store, reader: faultReader });

const recordButton = makeRecordButton({ store, live: recording });

/** What the menu does besides opening pages. @type {import("./panels/navigation.js").Order[]} */
const menuOrders = [
  { label: "Commands", hint: "Find a page, a command, a target", keys: "Ctrl-K", act: () => openPalette() },
  { label: "Settings", hint: "Colours, sizes, marks, keys", act: () => settings.showModal() },
  { label: "Dark or light", hint: "The other colours", act: flipTheme },
  { label: "Tour", hint: "Five steps: click, look around, measure, capture, gallery", act: () => tour.start() },
  { label: "Help", hint: "Keys, gestures and the guide", keys: "?", act: () => help.showModal() },
];
const openPalette = makePalette({
  store,
  lookAt: ({ id }) => void commands.lookAgain(id),
  orders: [
    { label: "Stop", hint: "Park the mirrors now", keys: "Space", act: () => void commands.stop() },
    { label: "Look around", hint: "Measure all of the wide view", act: inConsole(() => wideDepth.press()) },
    { label: "Follow what is clicked", hint: "On and off", keys: "T", act: inConsole(() => followOrders.toggle()) },
    { label: "Measure", hint: "Points, lengths, planes, profiles", keys: "M", act: inConsole(() => measure.toggle()) },
    { label: "Record", hint: "Begin or end a recording", keys: "R", act: () => recordButton.press() },
    { label: "Fit the wide view", hint: "All of the picture", keys: "0", act: inConsole(() => views.wide.fit()) },
    { label: "Faults and warnings", hint: "What is wrong now", keys: "E", act: () => faultTray.open() },
    { label: "Control", hint: "Who may move the mirrors", act: () => lease.showModal() },
    ...menuOrders.slice(1),
  ],
});
actions.palette = () => openPalette();

Object.assign(actions.keys, {
  "?": () => help.showModal(),
  i: () => flip("readout"),
  f: () => flip("footprints"),
  e: () => faultTray.open(),
  d: onWide(() => void views.wide.probe()),
  "+": onWide(() => views.wide.zoom(1.5)),
  "=": onWide(() => views.wide.zoom(1.5)),
  "-": onWide(() => views.wide.zoom(1 / 1.5)),
  0: onWide(() => views.wide.fit()),
  t: onWide(() => followOrders.toggle()),
  p: () => store.state.loop_page && void loopOrders.togglePause(),
  r: () => recordButton.press(),
  m: onWide(() => measure.toggle()),
  1: onWide(() => measure.choose(1)),
  2: onWide(() => measure.choose(2)),
  3: onWide(() => measure.choose(3)),
  4: onWide(() => measure.choose(4)),
});
actions.escape = escape;

keepOnTop(need("stop"));
equipDerived(views, commands);
need("eyes").append(derivedViews(views));
offerWindows(views, need("scene-window"));
mountBadges(need("badges"), { store, openLease: () => lease.showModal() });
mountSession({ button: need("signed-in"), strip: need("signed-in-viewer") }, { store, commands, session });
mountProblems(need("problems"), store);
mountStart(need("start"), store);
mountFixation(need("fixation"), need("announcer"), {
  store,
  commands,
  follows: followOrders,
  full,
  measure: () => measure.toggle(),
});
mountResultStrip(need("result"), store);
need("wide-depth").append(wideDepth.element);
const scene = new Scene(need("scene"), { store, keyboard });
need("targets").replaceChildren();
mountTargets(need("targets"), { store, commands, follows: followOrders, select: (target) => choose(target) });
const chooseList = connectTabs(["targets", "measurements", "followed"], (index) => {
  need("measurement-exports").hidden = index !== 1;
  store.set({ follow_tab: index === 2 });
});
mountMeasurements(need("measurements"), {
  store,
  orders: measureOrders,
  exports: need("measurement-exports"),
  show: () => chooseList(1),
});
mountFollowed(need("followed"), { store, orders: followOrders });
followOrders.started = () => chooseList(2);
views.pane("wide").tools.prepend(makeSteerDistance(store));
mountRigStatus(need("rig"), store);
const log = mountEventLog(need("events"), store);
turnPages({
  store,
  views,
  loaders: {
    wizard: async () => {
      const { mountWizard } = await import("./calibrating/calibration/page.js");
      return (place) => mountWizard(place, { store, orders, reader, work, toasts, views });
    },
    acceptance_page: async () => {
      const { mountAcceptancePage } = await import("./calibrating/acceptance/page.js");
      return (place) => mountAcceptancePage(place, { store, orders, reader, work });
    },
    rig_page: async () => {
      const { mountRigPage } = await import("./devices/rig/page.js");
      return (place) => mountRigPage(place, { store, orders, rig_orders: rigOrders, steering });
    },
    setup_page: async () => {
      const { mountSetupPage } = await import("./devices/setup/page.js");
      return (place) => mountSetupPage(place, { store, orders: setupOrders, reader: setupReader });
    },
    settings_page: async () => {
      const { mountSettingsPage } = await import("./preferences/page.js");
      return (place) => mountSettingsPage(place, { store, commands, preferences });
    },
    capture_page: async () => {
      const { mountCapturePage } = await import("./capturing/capture/page.js");
      return (place) =>
        mountCapturePage(place, {
          store,
          views,
          commands,
          capture_orders: captureOrders,
          capture_reader: captureReader,
          still_reader: stillReader,
        });
    },
    follow_page: async () => {
      const { mountFollowPage } = await import("./looking/follow/page.js");
      return (place) => mountFollowPage(place, { store, orders: followOrders });
    },
    loop_page: async () => {
      const { mountLoopPage } = await import("./looking/loop/page.js");
      return (place) => mountLoopPage(place, { store, orders: loopOrders });
    },
    gallery: async () => {
      const { mountGallery } = await import("./capturing/gallery/page.js");
      return (place) => mountGallery(place, { store, commands, reader: galleryReader });
    },
    planner_page: async () => {
      const { mountPlannerPage } = await import("./studying/planner/page.js");
      return (place) => mountPlannerPage(place, { store });
    },
    people: async () => {
      const { mountPeoplePage } = await import("./operating/people/page.js");
      return (place) => mountPeoplePage(place, { store, commands, session });
    },
    compare_page: async () => {
      const { mountComparePage } = await import("./looking/compare/page.js");
      return (place) => mountComparePage(place, { store, commands });
    },
    engine_page: async () => {
      const { mountEnginePage } = await import("./operating/engine/page.js");
      return (place) => mountEnginePage(place, { store });
    },
    rigs_page: async () => {
      const { mountRigsPage } = await import("./operating/rigs/page.js");
      return (place) => mountRigsPage(place, { store });
    },
  },
});
followAddress(store);
fill(
  need("tools"),
  recordButton.element,
  toolButton("Help (?)", "help", () => help.showModal()),
);
mountNavigation(need("activities"), { store, orders: menuOrders });
connectTabs(["rig", "events"], () => {
  store.set({ rig: store.state.rig }); // makes the panel that appears draw itself
  log.show();
});
store.on(["settings"], ({ settings: { theme } }) => {
  if (theme === "system") delete document.documentElement.dataset["theme"];
  else document.documentElement.dataset["theme"] = theme;
});
setInterval(() => void commands.renewLease(), LEASE_RENEWAL_MS);
watchSignIn(store);
sync.followAll();
exposeHooks({ store, views });

/** @param {import("#api").TargetDocument} target */
function choose(target) {
  scene.select(target);
  void fixations.recall(target.fixation_id);
}

function escape() {
  if (views.shrinkAll() || openPage(store.state) || measure.end() || followOrders.end()) return; // a key does not cancel a sweep
  views.wide.abandon();
  void commands.cancel();
}

/** Limit a key's action to the time when no other page covers the console. @param {() => void} act */
function onWide(act) {
  return () => {
    if (!openPage(store.state)) act();
  };
}

/** Return an action that opens the console first. @param {() => void} act */
function inConsole(act) {
  return () => {
    if (openPage(store.state)) location.hash = CONSOLE_ADDRESS;
    act();
  };
}

/** @param {"readout" | "footprints"} key */
function flip(key) {
  changeSettings(store, { [key]: !store.state.settings[key] });
}

function flipTheme() {
  const { theme } = store.state.settings;
  const dark = theme === "dark" || (theme === "system" && matchMedia("(prefers-color-scheme: dark)").matches);
  changeSettings(store, { theme: dark ? "light" : "dark" });
}
