"""Export and import of calibrations: our file format, and the authors' device bundles."""

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

from foveacam_hardware.contract import InvalidInput, Role
from foveacam_pipeline.calibrate.sweep.sweep_file import load_sweep
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.models.calibration_file import FORMAT, calibration_bytes, calibration_from
from foveacam_server.foundation.errors import NotFound
from foveacam_server.resources.calibrating.calibrations.measured_data import MeasuredSessions

FileFormat = Literal["foveacam", "authors"]


def known_format(name: str) -> FileFormat:
    """Return the format of that name; raise `InvalidInput` for another."""
    if name == "foveacam":
        return "foveacam"
    if name == "authors":
        return "authors"
    raise InvalidInput(f"--format {name}: the formats are foveacam and authors")


@dataclass(frozen=True, slots=True, kw_only=True)
class ImportFacts:
    """The rig that a calibration is imported for; `distance_m`: of the markers, which bundles leave out."""

    rig_id: str
    baseline_m: float = 0.2
    distance_m: float | None = None
    fovea_size: tuple[int, int] = (1440, 1080)
    wide_size: tuple[int, int] | None = None


def export_bytes(calibration: Calibration, file_format: FileFormat, *, sessions: MeasuredSessions) -> bytes:
    """Return a calibration as a file's bytes; the authors' format needs its session with the poses."""
    if file_format == "foveacam":
        return calibration_bytes(calibration)
    from foveacam_pipeline.calibrate.exchange import bundle_document, bundle_of

    sweeps = [load_sweep(path) for path in _sweeps_of(calibration, sessions)]
    document = bundle_document(bundle_of(calibration, sweeps), exported=calibration.created)
    return (json.dumps(document, indent=2, ensure_ascii=False, allow_nan=False) + "\n").encode()


def calibration_of(document: object, facts: ImportFacts) -> Calibration:
    """Return the calibration of a file; raise `InvalidInput` for one that is damaged or of another rig."""
    if not isinstance(document, Mapping):
        raise InvalidInput("import: a JSON object is needed; give the file of a calibration as it is")
    if document.get("format") == FORMAT:
        calibration = calibration_from(document, what="that was sent")
        calibration.check_rig(facts.rig_id)
        return calibration
    schema = str(document.get("schema", ""))
    if schema.startswith("fovea-device-config@"):
        return _from_bundle(document, facts)
    if schema.startswith("fovea-calibration-record@"):
        raise InvalidInput(
            "import: a single record holds one eye or the wide camera, a calibration needs all three",
            found=schema,
            remedy="import the device bundle (fovea-device-config@1) that holds them",
        )
    named = document.get("format", document.get("schema"))
    found = "the file names neither" if named is None else f"{named!r} was found"
    raise InvalidInput(
        f"import: format {FORMAT!r} or schema 'fovea-device-config@1' is needed, {found}",
        asked="a calibration file",
        remedy="give a calibration file that this program or the authors' application exported",
    )


def _from_bundle(document: Mapping[str, object], facts: ImportFacts) -> Calibration:
    from foveacam_pipeline.calibrate.exchange import (
        ImportedRig,
        NominalOptics,
        bundle_from,
        intrinsics_of,
        record_of,
        rig_sweep_of,
        settings_of,
    )
    from foveacam_pipeline.calibrate.fit.fit import fit_calibration

    bundle = bundle_from(document, what="the imported bundle")  # type: ignore[arg-type]  # it checks all of it
    if facts.distance_m is None or not math.isfinite(facts.distance_m):
        raise InvalidInput(
            "import: the authors' files do not say how far away the markers stood",
            asked="a calibration from a device bundle",
            remedy="give distance_m as well, the distance from the wide camera to the markers",
        )
    wide = intrinsics_of(record_of(bundle, Role.WIDE))
    _check_wide((wide.width, wide.height), facts.wide_size)
    settings = settings_of(bundle)
    rig = ImportedRig(
        rig_id=facts.rig_id,
        fovea_size=facts.fovea_size,
        distance_m=facts.distance_m,
    )
    sweep = rig_sweep_of(
        record_of(bundle, Role.LEFT),
        record_of(bundle, Role.RIGHT),
        wide=wide,
        rig=rig,
        optics=NominalOptics(baseline_m=settings.baseline_m or facts.baseline_m),
        drift_rad=settings.drift_rad,
    )
    return replace(fit_calibration(sweep), origin="imported")


def _check_wide(found: tuple[int, int], here: tuple[int, int] | None) -> None:
    """Raise `InvalidInput` when a bundle's wide camera has other pixels than the rig's."""
    if here is None or found == here:
        return
    words = f"its wide camera has {found[0]} × {found[1]} px, this rig's has {here[0]} × {here[1]} px"
    raise InvalidInput(
        f"import: {words}",
        asked="a calibration from a device bundle",
        found=words,
        remedy="import the bundle of this rig",
    )


def _sweeps_of(calibration: Calibration, sessions: MeasuredSessions) -> tuple[Path, ...]:
    if calibration.session_id is not None:
        try:
            return sessions.sweeps(calibration.session_id)
        except NotFound:
            pass
    raise InvalidInput(
        f"calibration {calibration.id}: the authors' records hold the measured poses, and the session that "
        "measured it is not kept here",
        asked="the authors' format",
        found="no session with its poses",
        remedy="export it in the format foveacam",
    )
