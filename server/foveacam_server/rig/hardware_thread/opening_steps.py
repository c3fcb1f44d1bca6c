"""The steps in which a rig is opened, with the state of each; devices open one after the other."""

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from enum import StrEnum

from foveacam_hardware.contract import Cancelled, Clock, FoveaError
from foveacam_server.rig.device_reconnector import BASE, DeviceReconnector
from foveacam_server.rig.hardware_thread.kernel_preparation import KernelProgress, Preparation
from foveacam_server.rig.ports import AssembledRig, RigProblem

RIG = "rig"
"""The step before all devices: read the rig file and construct the rig."""
RENDERER = "renderer"
"""A step of simulated rigs only: compile or load the kernels."""
COMPILED_HERE = "The server compiled its kernels by itself: "
REMEDY = "correct it and start the server again"
FIRST_DEVICES = ("mirrors", "wide", "left", "right")
"""Devices that every rig has."""


class StepState(StrEnum):
    """State of a step."""

    PENDING = "pending"
    ACTIVE = "active"
    DONE = "done"
    FAILED = "failed"


@dataclass(frozen=True, slots=True, kw_only=True)
class OpeningStep:
    """One step of the opening; `detail`, `remedy`: why it failed, and what to do; or its progress.

    `left_s`: time left, None while unknown. `began_ns`, `ended_ns`: by the rig's clock; None before it has
    begun or ended.
    """

    device: str
    state: StepState = StepState.PENDING
    detail: str = ""
    remedy: str | None = None
    left_s: float | None = None
    began_ns: int | None = None
    ended_ns: int | None = None


class OpeningSteps:
    """Implements `RigOpeningWatch`: written by the hardware thread, read by any thread."""

    def __init__(self, *, clock: Clock) -> None:
        self._clock = clock
        self._steps: tuple[OpeningStep, ...] = ()
        self.begin()

    @property
    def every(self) -> tuple[OpeningStep, ...]:
        """All steps in their order."""
        return self._steps

    def begin(self) -> None:
        """Start again with all steps pending."""
        self._steps = tuple(OpeningStep(device=device) for device in (RIG, *FIRST_DEVICES))

    def expect(self, devices: Sequence[str]) -> None:
        """Add the devices that this rig has besides those of every rig."""
        self._steps += tuple(OpeningStep(device=device) for device in devices)

    def expect_renderer(self) -> None:
        """Add the renderer, before all devices."""
        file, *devices = self._steps
        self._steps = (file, OpeningStep(device=RENDERER), *devices)

    def moves_on(self, device: str, *, detail: str, left_s: float | None) -> None:
        """Record the progress of a step."""
        self._change(device, lambda step: replace(step, detail=detail, left_s=left_s))

    def begins(self, device: str) -> None:
        """Record that a step is under way."""
        now_ns = self._clock.now_ns()
        self._change(device, lambda step: replace(step, state=StepState.ACTIVE, began_ns=now_ns))

    def ends(self, device: str, problem: RigProblem | None) -> None:
        """Record that a step is done, or why it failed."""
        now_ns = self._clock.now_ns()
        if problem is None:
            self._change(
                device, lambda step: replace(step, state=StepState.DONE, left_s=None, ended_ns=now_ns)
            )
        else:
            why, remedy = problem.detail, problem.remedy
            failed = StepState.FAILED
            self._change(
                device,
                lambda step: replace(step, state=failed, detail=why, remedy=remedy, ended_ns=now_ns),
            )

    def _change(self, device: str, change: Callable[[OpeningStep], OpeningStep]) -> None:
        self._steps = tuple(change(step) if step.device == device else step for step in self._steps)


class RigOpening:
    """Opens a rig with the devices that answer, step by step."""

    def __init__(
        self,
        opener: Callable[[], AssembledRig],
        reconnector: DeviceReconnector,
        *,
        clock: Clock,
        prepare: Preparation | None = None,
        cancelled: Callable[[], bool] = lambda: False,
    ) -> None:
        """`prepare`: preparation of a simulated rig, before its devices; `cancelled`: whether to end."""
        self._opener = opener
        self._reconnector = reconnector
        self._prepare, self._cancelled = prepare, cancelled
        self.steps = OpeningSteps(clock=clock)
        """The steps of the last opening."""

    def open(self) -> AssembledRig | None:
        """Build the rig and connect its devices; None when it cannot be built. Hardware thread only."""
        self.steps.begins(RIG)
        try:
            rig = self._opener()
        except FoveaError as error:
            self._reconnector.add_problem(RIG, detail=str(error), remedy=error.remedy or REMEDY)
            self.steps.ends(RIG, self._reconnector.problem_of(RIG))
            return None
        self.steps.ends(RIG, None)
        if self._prepare is not None and rig.simulated:
            self._open_renderer(self._prepare)
        self.steps.expect([name for name in BASE if getattr(rig, name) is not None])
        if not self._cancelled():
            self._reconnector.connect(rig, watch=self.steps)
        return rig

    def _open_renderer(self, prepare: Preparation) -> None:
        self.steps.expect_renderer()
        self.steps.begins(RENDERER)

        def show(progress: KernelProgress) -> None:
            self.steps.moves_on(RENDERER, detail=str(progress), left_s=progress.left_s)

        with suppress(Cancelled):
            why = prepare(show, cancelled=self._cancelled)
            self.steps.moves_on(RENDERER, detail="" if why is None else COMPILED_HERE + why, left_s=None)
            self.steps.ends(RENDERER, None)

    @property
    def preparing(self) -> bool:
        """Whether the renderer of a simulated rig is being compiled or loaded."""
        return any(step.device == RENDERER and step.state is StepState.ACTIVE for step in self.steps.every)
