"""Conversion of a whole calibrated rig to the authors' device bundle, and of a bundle's settings to ours."""

from collections.abc import Sequence
from dataclasses import dataclass

from foveacam_hardware.contract import InvalidInput, Role
from foveacam_pipeline.calibrate.exchange.canonical import Json
from foveacam_pipeline.calibrate.exchange.extrinsic import extrinsic_record
from foveacam_pipeline.calibrate.exchange.files import DeviceBundle
from foveacam_pipeline.calibrate.exchange.intrinsic import intrinsic_record
from foveacam_pipeline.calibrate.exchange.record import ExchangeRecord, RecordKind
from foveacam_pipeline.calibrate.sweep.sweep import Sweep
from foveacam_pipeline.models.calibration import Calibration

NO_DRIFT = ((0.0, 0.0), (0.0, 0.0))


@dataclass(frozen=True, slots=True, kw_only=True)
class RigSettings:
    """The operator's settings of a rig; `drift_rad`: corrections of drift, left and right (ax, ay)."""

    nickname: str | None = None
    baseline_m: float | None = None
    settle_us: float | None = None
    drift_rad: tuple[tuple[float, float], tuple[float, float]] = NO_DRIFT


def bundle_of(
    calibration: Calibration,
    sweeps: Sequence[Sweep],
    *,
    settings: RigSettings | None = None,
    rms_px: float | None = None,
) -> DeviceBundle:
    """Return the bundle of a calibration and of the sweeps it was fitted to.

    The authors' application ignores the distance of the markers, so the bundle has the sweep with the
    farthest ones. `rms_px`: of the wide camera's solve, if known.
    """
    if not sweeps:
        raise InvalidInput(
            f"calibration {calibration.id} comes without the sweep it was fitted to, and the authors' "
            "records hold the sweep alone; export a calibration whose session is kept"
        )
    calibration.check_rig(sweeps[0].header.rig_id)
    sweep = max(sweeps, key=lambda known: known.header.station.distance_m or 0.0)
    label = calibration.label
    records = [
        intrinsic_record(calibration.wide, created_utc=sweep.header.created_utc, label=label, rms_px=rms_px),
        *(
            extrinsic_record(sweep, role, wide=calibration.wide, label=label)
            for role in (Role.LEFT, Role.RIGHT)
        ),
    ]
    return DeviceBundle(
        config=_config(calibration, settings or RigSettings()),
        records=tuple(records),
    )


def settings_of(bundle: DeviceBundle) -> RigSettings:
    """Return the settings of a bundle's rig, in our units."""
    config = bundle.settings
    drifts = [
        (0.0, 0.0) if point is None else (point.x, point.y) for point in (config.drift_l, config.drift_r)
    ]
    return RigSettings(
        nickname=config.nickname,
        baseline_m=None if config.baseline_mm is None else 1e-3 * config.baseline_mm,
        settle_us=config.settle_time_us,
        drift_rad=(drifts[0], drifts[1]),
    )


def record_of(bundle: DeviceBundle, role: Role) -> ExchangeRecord:
    """Return the newest record of a camera: the wide one's solve, or an eye's poses."""
    kind = RecordKind.INTRINSIC if role is Role.WIDE else RecordKind.EXTRINSIC
    fitting = [record for record in bundle.records if record.kind is kind and record.role is role]
    if not fitting:
        raise InvalidInput(
            f"the device bundle holds no {kind.value} record of the {role.value} camera; "
            "export it with all its records"
        )
    return max(fitting, key=lambda record: record.created_utc)


def _config(calibration: Calibration, settings: RigSettings) -> dict[str, Json]:
    left, right = settings.drift_rad
    return {
        "nickname": settings.nickname or calibration.rig_id,
        "baseline_mm": 1e3 * calibration.baseline_m,
        "zoom_override": 0,
        "settle_time_us": settings.settle_us or 0,
        "delay_compensation_ms": 0,
        "drift_l": {"x": left[0], "y": left[1]},
        "drift_r": {"x": right[0], "y": right[1]},
    }
