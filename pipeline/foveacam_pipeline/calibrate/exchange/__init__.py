"""Import and export of the calibration records and device bundles of the authors' application."""

from foveacam_pipeline.calibrate.exchange.angles import NominalOptics, rig_sweep_of
from foveacam_pipeline.calibrate.exchange.bundle import (
    RigSettings,
    bundle_of,
    record_of,
    settings_of,
)
from foveacam_pipeline.calibrate.exchange.canonical import record_id
from foveacam_pipeline.calibrate.exchange.extrinsic import ImportedRig, extrinsic_record
from foveacam_pipeline.calibrate.exchange.files import (
    DeviceBundle,
    bundle_document,
    bundle_from,
)
from foveacam_pipeline.calibrate.exchange.intrinsic import intrinsic_record, intrinsics_of
from foveacam_pipeline.calibrate.exchange.record import ExchangeRecord, RecordKind

__all__ = [
    "DeviceBundle",
    "ExchangeRecord",
    "ImportedRig",
    "NominalOptics",
    "RecordKind",
    "RigSettings",
    "bundle_document",
    "bundle_from",
    "bundle_of",
    "extrinsic_record",
    "intrinsic_record",
    "intrinsics_of",
    "record_id",
    "record_of",
    "rig_sweep_of",
    "settings_of",
]
