"""Import and export of the calibration records and device bundles of the authors' application."""

from foveacam_pipeline.calibrate.exchange.angles import NominalOptics, rig_sweep_of
from foveacam_pipeline.calibrate.exchange.bundle import (
    CameraKeys,
    RigSettings,
    bundle_of,
    record_of,
    settings_of,
)
from foveacam_pipeline.calibrate.exchange.canonical import camera_key, record_id, triple_hash
from foveacam_pipeline.calibrate.exchange.extrinsic import ImportedRig, extrinsic_record, sweep_of
from foveacam_pipeline.calibrate.exchange.files import (
    DeviceBundle,
    bundle_document,
    bundle_from,
    read_bundle,
    read_record,
    record_document,
    record_from,
    write_bundle,
    write_record,
)
from foveacam_pipeline.calibrate.exchange.intrinsic import intrinsic_record, intrinsics_of
from foveacam_pipeline.calibrate.exchange.record import ExchangeRecord, RecordKind

__all__ = [
    "CameraKeys",
    "DeviceBundle",
    "ExchangeRecord",
    "ImportedRig",
    "NominalOptics",
    "RecordKind",
    "RigSettings",
    "bundle_document",
    "bundle_from",
    "bundle_of",
    "camera_key",
    "extrinsic_record",
    "intrinsic_record",
    "intrinsics_of",
    "read_bundle",
    "read_record",
    "record_document",
    "record_from",
    "record_id",
    "record_of",
    "rig_sweep_of",
    "settings_of",
    "sweep_of",
    "triple_hash",
    "write_bundle",
    "write_record",
]
