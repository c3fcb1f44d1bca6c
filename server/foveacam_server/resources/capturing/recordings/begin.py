"""Prepares a recording: describes the rig, gets the frame rates, checks the disk space."""

from collections.abc import Iterable

from foveacam_hardware.contract import Role
from foveacam_pipeline.capture.recording.session import RigDescription
from foveacam_pipeline.capture.recording.values import STREAM_OF_ROLE
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.storage.free_space import RESERVE_BYTES, RESERVE_TEXT, free_space_error
from foveacam_server.rig.live_views import LiveRates
from foveacam_server.rig.ports import AssembledRig


def identity_of(rig: AssembledRig, calibration: Calibration | None) -> RigDescription:
    """Return the rig's description for a recording; call it on the rig's thread."""
    cameras = {Role.WIDE: rig.wide, Role.LEFT: rig.left, Role.RIGHT: rig.right}
    return RigDescription(
        rig_id=rig.rig_id,
        name=rig.name,
        baseline_m=rig.baseline_m,
        cameras={STREAM_OF_ROLE[role]: camera.info for role, camera in cameras.items()},
        calibration=calibration,
    )


def full_rates(rig: AssembledRig) -> LiveRates:
    """Return the highest frame rates, Hz: of the wide camera, and of successive looks."""
    look_ns = 1_000 * rig.settle_us + max(rig.left.settings.exposure_ns, rig.right.settings.exposure_ns)
    return LiveRates(wide_hz=rig.wide.settings.frame_rate_hz, fovea_hz=1e9 / max(1, look_ns))


def check_room(frames: Iterable[tuple[int, float]], *, duration_s: float | None, free_bytes: int) -> None:
    """Raise `OutOfRange`, or `StorageFull` for a full disk, with both sizes when it does not fit.

    Without a duration one second must fit: the recording ends by itself at the disk's reserve.
    `frames`: bytes of a frame and rate, Hz, of every camera.
    """
    asked_s = 1.0 if duration_s is None else duration_s
    needed_bytes = RESERVE_BYTES + round(asked_s * sum(size * rate_hz for size, rate_hz in frames))
    if needed_bytes > free_bytes:
        raise free_space_error(
            f"recording of {asked_s:g} s: about {needed_bytes / 1e6:.0f} MB are needed, with the "
            f"{RESERVE_TEXT}; {free_bytes / 1e6:.0f} MB are free on the disk",
            needed_bytes=needed_bytes,
            free_bytes=free_bytes,
            remedy="free some, or record fewer cameras or a shorter time",
        )
