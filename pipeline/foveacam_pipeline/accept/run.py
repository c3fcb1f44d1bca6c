"""The acceptance run: all checks in an order in which each can trust what the ones before it have shown.

A check whose ground a named fault has taken away is not made: what it would show follows from that fault.
"""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import TypeVar

from foveacam_hardware.contract import (
    Binning,
    Cancelled,
    FoveaError,
    PanTiltPose,
    Role,
    Sighting,
    Station,
    Stopped,
)
from foveacam_pipeline.accept import (
    axes,
    drawings,
    frames,
    geometry,
    light,
    pictures,
    repeatability,
    sensors,
    stopping,
    timing,
    triggers,
)
from foveacam_pipeline.accept.axes import AxisResponse
from foveacam_pipeline.accept.environment import AcceptanceEnvironment, AcceptanceOptions
from foveacam_pipeline.accept.limits import AcceptanceLimits
from foveacam_pipeline.accept.order import (
    AXES,
    CLOCK_TITLE,
    DEVICES_TITLE,
    EXACT,
    LINES,
    MARKERS,
    PICTURES,
    RETURNING,
    STILL,
    TITLES,
    costs_of,
    short_title,
)
from foveacam_pipeline.accept.progress import CountedSteps, NotedTurn, RunProgress
from foveacam_pipeline.accept.repeatability import RestPlaces
from foveacam_pipeline.accept.rig_under_test import RigUnderTest
from foveacam_pipeline.accept.triggers import LineState
from foveacam_pipeline.accept.values import (
    Acceptance,
    AcceptanceCheck,
    Fault,
    Measured,
    NamedFault,
    Verdict,
    judged,
    not_done,
)
from foveacam_pipeline.calibrate.settle.settle_report import settle_picture
from foveacam_pipeline.calibrate.settle.settle_values import SettleReport
from foveacam_pipeline.calibrate.watcher import ProcedureWatcher

T = TypeVar("T")


def run_acceptance(
    environment: AcceptanceEnvironment,
    *,
    begun_utc: str,
    watch: ProcedureWatcher,
    options: AcceptanceOptions,
) -> Acceptance:
    """Run all checks; a run that is cancelled or stopped returns the checks that were made until then."""
    run = _Run(environment, begun_utc=begun_utc, watch=watch, options=options)
    begun_ns = environment.clock.now_ns()
    complete = True
    try:
        run.run_all()
    except (Cancelled, Stopped):
        complete = False
    return Acceptance(
        rig_id=environment.rig_id,
        calibration_id=None if environment.calibration is None else environment.calibration.id,
        begun_utc=begun_utc,
        duration_s=(environment.clock.now_ns() - begun_ns) / 1e9,
        complete=complete,
        checks=tuple(run.checks),
        pictures=run.pictures,
        settling=run.settling,
    )


class _Run:
    """One run: its results so far, and what later checks need of earlier ones."""

    def __init__(
        self,
        environment: AcceptanceEnvironment,
        *,
        begun_utc: str,
        watch: ProcedureWatcher,
        options: AcceptanceOptions,
    ) -> None:
        self._environment = environment
        self._begun_utc = begun_utc
        self._watch = watch
        self._options = options
        self._limits = AcceptanceLimits()
        self.checks: list[AcceptanceCheck] = []
        self.pictures: dict[str, bytes] = {}
        self.settling: SettleReport | None = None
        self._lines: dict[Role, LineState] = {}
        self._home: Sighting | None = None
        self._rest: RestPlaces | None = None
        self._response: AxisResponse | None = None
        self._spread_deg = 0.0
        self._unusable = ""
        self._progress = RunProgress(watch, costs_of(options.looks, options.wide_s))

    def run_all(self) -> None:
        """Make every check."""
        self._check("devices", frozenset(), self._devices)
        if self._blocking(frozenset({Fault.MISSING_DEVICE})):
            why = f"waits for: {short_title('devices')}"
            self.checks += [not_done(name, TITLES[name], why) for name in list(TITLES)[1:]]
            return
        self._group(1, self._still_checks)
        self._group(None, self._moving_checks)
        missed = [name for name in TITLES if name not in {check.name for check in self.checks}]
        self.checks += [not_done(name, TITLES[name], self._unusable) for name in missed]

    def _group(self, binning: Binning | None, work: Callable[[RigUnderTest], None]) -> None:
        """Make some checks with the rig reserved; one that cannot be reserved leaves them to `run_all`."""
        try:
            with self._environment.use(binning) as access:
                begun = self._progress.step
                work(RigUnderTest(access, self._environment.layout, self._watch, begun=begun))
        except (Cancelled, Stopped):
            raise
        except FoveaError as error:
            self._unusable = str(error)

    def _still_checks(self, rig: RigUnderTest) -> None:
        """Make the checks of single pictures, which have every pixel."""
        self._check("triggers", frozenset({Fault.MISSING_DEVICE}), lambda: self._triggers(rig))
        self._check("pictures", LINES, lambda: self._pictures(rig))
        self._check("focus", MARKERS, lambda: self._focus(rig))
        self._check("sensors", PICTURES, lambda: self._sensors(rig))

    def _moving_checks(self, rig: RigUnderTest) -> None:
        self._check("rest", MARKERS, lambda: self._rest_check(rig))
        self._check("axes", STILL, lambda: self._axes(rig))
        self._check("light", AXES, lambda: self._light(rig))
        self._check("frames", PICTURES, lambda: self._frames(rig))
        self._check("returns", AXES, lambda: self._returns(rig))
        self._check("gains", RETURNING, self._gains)
        self._check("timing", RETURNING | {Fault.LOST_FRAMES}, lambda: self._timing(rig))
        self._check("geometry", EXACT, lambda: self._geometry(rig))
        self._check("stop", AXES, lambda: self._stop(rig))
        self._check("clock", frozenset({Fault.MISSING_DEVICE}), lambda: self._clock(rig))

    def _blocking(self, faults: frozenset[Fault]) -> list[AcceptanceCheck]:
        """Return the checks that named one of these faults."""
        return [check for check in self.checks if any(found.fault in faults for found in check.findings)]

    def _check(self, name: str, blocked_by: frozenset[Fault], work: Callable[[], AcceptanceCheck]) -> None:
        """Make one check, unless a fault that was named makes it meaningless."""
        title = TITLES[name]
        self._progress.begin(name, short_title(name))
        blocking = self._blocking(blocked_by)
        if blocking:
            result = not_done(name, title, f"waits for: {short_title(blocking[0].name)}")
        else:
            try:
                result = work()
            except (Cancelled, Stopped):
                raise
            except FoveaError as error:
                result = not_done(name, title, str(error))
        self.checks.append(result)
        self._progress.end()

    def _devices(self) -> AcceptanceCheck:
        findings = [
            NamedFault(fault=Fault.MISSING_DEVICE, subject=device, detail=f"{device}: {why}")
            for device, why in self._environment.problems
        ]
        return judged("devices", DEVICES_TITLE, findings=findings)

    def _triggers(self, rig: RigUnderTest) -> AcceptanceCheck:
        result, self._lines = triggers.check_triggers(rig)
        return result

    def _pictures(self, rig: RigUnderTest) -> AcceptanceCheck:
        if not self._environment.stations:
            return not_done("pictures", pictures.TITLE, "the rig file names no station with markers; add one")
        self._turn(rig, self._environment.stations[0])
        result, self._home = pictures.check_pictures(rig)
        self.pictures["pictures"] = drawings.draw_pictures(self._home, self._environment.layout)
        return result

    def _focus(self, rig: RigUnderTest) -> AcceptanceCheck:
        home = _known(self._home, "a look at the markers")
        return pictures.check_focus(home, rig.layout, self._limits)

    def _rest_check(self, rig: RigUnderTest) -> AcceptanceCheck:
        _known(self._home, "a look at the markers")
        self._rest = repeatability.rest_places(rig)
        self.pictures["rest"] = drawings.draw_rest(self._rest)
        return repeatability.check_rest(self._rest, self._limits)

    def _axes(self, rig: RigUnderTest) -> AcceptanceCheck:
        _known(self._home, "a look at the markers")
        result, self._response = axes.check_axes(rig, self._environment.calibration)
        self.pictures["axes"] = drawings.draw_axes(self._response)
        return result

    def _gains(self) -> AcceptanceCheck:
        response = _known(self._response, "the motion of the axes")
        return axes.check_gains(response, self._limits, self._environment.calibration)

    def _sensors(self, rig: RigUnderTest) -> AcceptanceCheck:
        result, taken = sensors.check_sensors(rig, self._limits)
        self.pictures["noise"] = drawings.draw_noise(taken)
        return result

    def _frames(self, rig: RigUnderTest) -> AcceptanceCheck:
        result, wide = frames.check_frames(
            rig, self._limits, looks=self._options.looks, wide_s=self._options.wide_s
        )
        self.pictures["frames"] = drawings.draw_frames(wide)
        return result

    def _returns(self, rig: RigUnderTest) -> AcceptanceCheck:
        before = _known(self._rest, "the pictures at rest")
        returns = repeatability.measured_returns(rig)
        after = repeatability.rest_places(rig)
        self._spread_deg = repeatability.return_spread_deg(returns)
        self.pictures["returns"] = drawings.draw_returns(returns)
        return repeatability.check_returns(returns, before, after, self._limits)

    def _timing(self, rig: RigUnderTest) -> AcceptanceCheck:
        result, report = timing.check_timing(
            rig,
            self._limits,
            step=self._options.step,
            lines=self._lines,
            rig_id=self._environment.rig_id,
            begun_utc=self._begun_utc,
            watch=CountedSteps(self._watch, self._progress.step),
        )
        if result.verdict is Verdict.PASSED:  # else its times are those of the fault
            self.settling = report
        self.pictures["timing"] = settle_picture(report)
        return result

    def _turn(self, rig: RigUnderTest, station: Station) -> None:
        self._environment.turn(rig.access, station, NotedTurn(self._watch, self._progress.report))

    def _light(self, rig: RigUnderTest) -> AcceptanceCheck:
        _known(self._home, "a look at the markers")
        station = self._environment.stations[0]

        def turn_beside(pan_rad: float, tilt_rad: float) -> None:
            pose = PanTiltPose(
                pan_rad=station.pose.pan_rad + pan_rad, tilt_rad=station.pose.tilt_rad + tilt_rad
            )
            self._turn(rig, replace(station, pose=pose))

        turn = turn_beside if self._environment.turns else None
        result, samples = light.check_light(rig, self._limits, turn=turn)
        self.pictures["light"] = drawings.draw_light(samples)
        return result

    def _geometry(self, rig: RigUnderTest) -> AcceptanceCheck:
        _known(self._home, "a look at the markers")
        calibration = self._environment.calibration
        if calibration is None:
            return not_done(
                "geometry", geometry.TITLE, "no calibration is in force; run foveacam calibrate all"
            )
        stations = self._environment.stations
        try:
            result, measures = geometry.check_geometry(
                rig,
                self._limits,
                calibration,
                stations=stations,
                turn=lambda station: self._turn(rig, station),
            )
        finally:
            self._turn(rig, stations[0])  # the stop is checked there
        self.pictures["distances"] = drawings.draw_distances(measures)
        return result

    def _stop(self, rig: RigUnderTest) -> AcceptanceCheck:
        _known(self._rest, "the pictures at rest")
        spread_px = math.radians(self._spread_deg) * axes.FOCAL_PX
        return stopping.check_stop(rig, self._limits, spread_px=spread_px)

    def _clock(self, rig: RigUnderTest) -> AcceptanceCheck:
        drift_ppm = rig.on_device(lambda devices: devices.mirrors.telemetry).clock_drift_ppm
        if drift_ppm is None:
            return not_done("clock", CLOCK_TITLE, "the controller's clock was not followed for long enough")
        figure = Measured(
            name="controller's clock against the host's",
            value=round(drift_ppm, 1),
            unit="ppm",
            low=-self._limits.clock_ppm,
            high=self._limits.clock_ppm,
        )
        detail = f"the controller's clock runs {drift_ppm:+.0f} ppm against the host's"
        found = NamedFault(fault=Fault.CONTROLLER_CLOCK, subject="", detail=detail)
        findings = () if figure.is_within else (found,)
        return judged("clock", CLOCK_TITLE, figures=[figure], findings=findings)


def _known(value: T | None, what: str) -> T:
    if value is None:
        raise FoveaError(f"it needs {what}, which a check above could not give")
    return value
