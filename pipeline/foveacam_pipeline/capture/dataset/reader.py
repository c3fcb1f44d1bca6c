"""Reads a dataset: `Dataset.open(path)[i].left`. Images are read on demand; nothing is written."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Self, overload

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import (
    Frame,
    Image,
    InvalidInput,
    MirrorVolts,
    NotCalibrated,
    Role,
    Sighting,
    StereoVolts,
)
from foveacam_pipeline.capture.dataset.document import DatasetDocument, read_document
from foveacam_pipeline.capture.dataset.images import decode
from foveacam_pipeline.capture.dataset.journal import read_journal
from foveacam_pipeline.capture.dataset.lock import is_being_written
from foveacam_pipeline.capture.dataset.values import DatasetState, FrameRecord, PlanPosition, PointRecord
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.stereo.rectify import rectify
from foveacam_pipeline.stereo.values import RectifiedPair
from foveacam_pipeline.storage.archive import read_stored

INTERRUPTED = "interrupted: the program that wrote it ended without closing it; resume it"


@dataclass(frozen=True, slots=True, kw_only=True)
class PointPose:
    """The pose of the rig at a point: gazes (ax, ay), rad, and volts of both eyes; None where unknown."""

    left_rad: tuple[float, float] | None
    right_rad: tuple[float, float] | None
    volts: StereoVolts | None
    rail_m: float | None


class DatasetPoint:
    """One point of a dataset. `left`, `right`, `wide`: the first frame of the first bracket, as captured."""

    def __init__(self, folder: Path, record: PointRecord, calibration: Calibration | None) -> None:
        self._folder, self._record, self._calibration = folder, record, calibration

    @property
    def place(self) -> PlanPosition:
        """Its position in the plan."""
        return self._record.place

    @property
    def index(self) -> int:
        """Its number in the plan."""
        return self._record.place.index

    @property
    def frames(self) -> tuple[FrameRecord, ...]:
        """The records of its frames."""
        return self._record.frames

    @property
    def left(self) -> Image:
        """(h, w) grey or (h, w, 3) RGB, uint8 or uint16."""
        return self.frame(Role.LEFT).image

    @property
    def right(self) -> Image:
        """(h, w) grey or (h, w, 3) RGB, uint8 or uint16."""
        return self.frame(Role.RIGHT).image

    @property
    def wide(self) -> Image:
        """(h, w) grey or (h, w, 3) RGB, uint8 or uint16."""
        return self.frame(Role.WIDE).image

    @property
    def brackets(self) -> tuple[int, ...]:
        """Numbers of the exposures of the foveae."""
        return tuple(sorted({frame.bracket for frame in self.frames if frame.role is not Role.WIDE}))

    @property
    def pose(self) -> PointPose:
        """The pose of the rig during the first exposure."""
        left, right = self._find(Role.LEFT, 0), self._find(Role.RIGHT, 0)
        return PointPose(
            left_rad=left[0].gaze_rad if left else None,
            right_rad=right[0].gaze_rad if right else None,
            volts=self._volts(0),
            rail_m=self.place.rail_m,
        )

    def frame(self, role: Role, *, bracket: int = 0, stack: int = 0) -> Frame:
        """Read one frame as the camera delivered it."""
        for record in self._find(role, bracket):
            if record.stack == stack:
                return self._read(record)
        raise self._missing(role, bracket, f", frame {stack} of its stack")

    def stacked(self, role: Role, *, bracket: int = 0) -> Frame:
        """Return the mean of a stack as a 16-bit frame with the first frame's metadata; one alone as is."""
        records = self._find(role, bracket)
        if not records:
            raise self._missing(role, bracket, "")
        first = self._read(records[0])
        if len(records) == 1:
            return first
        total = np.zeros(first.image.shape, dtype=np.float64)
        for record in records:
            total += self._read(record).image
        scale = 2.0 ** (16 - first.bits) / len(records)
        mean: NDArray[np.uint16] = np.rint(np.minimum(total * scale, 65535.0)).astype(np.uint16)
        return replace(first, image=mean, bits=16)

    def rectified(self, *, scale: float = 0.5, bracket: int = 0) -> RectifiedPair:
        """Return the rectified pair, computed with the dataset's calibration; scale 0.5 or 1.0."""
        if self._calibration is None:
            raise NotCalibrated(
                f"point {self.index} in {self._folder}: the dataset has no calibration; "
                "calibrate before a capture"
            )
        return rectify(self.sighting(bracket=bracket), self._calibration, scale=scale)

    def sighting(self, *, bracket: int = 0) -> Sighting:
        """Return both foveae of a bracket as one look; the left frame replaces a missing wide one."""
        volts = self._volts(bracket)
        if volts is None:
            raise InvalidInput(
                f"point {self.index} in {self._folder}: the volts of its mirrors are not known"
            )
        left, right = (self.stacked(role, bracket=bracket) for role in (Role.LEFT, Role.RIGHT))
        wide = self.frame(Role.WIDE) if self._find(Role.WIDE, 0) else left
        return Sighting(left=left, right=right, wide=wide, volts=volts)

    def _volts(self, bracket: int) -> StereoVolts | None:
        """Return the mean volts of each mirror over the stack of a bracket."""
        means = []
        for role in (Role.LEFT, Role.RIGHT):
            known = [record.volts_v for record in self._find(role, bracket) if record.volts_v is not None]
            if not known:
                return None
            count = len(known)
            means.append(
                MirrorVolts(
                    x_v=math.fsum(v[0] for v in known) / count, y_v=math.fsum(v[1] for v in known) / count
                )
            )
        return StereoVolts(left=means[0], right=means[1])

    def _find(self, role: Role, bracket: int) -> list[FrameRecord]:
        found = [frame for frame in self.frames if frame.role is role and frame.bracket == bracket]
        return sorted(found, key=lambda record: record.stack)

    def _read(self, record: FrameRecord) -> Frame:
        path = self._folder / record.file
        try:
            content = read_stored(self._folder, record.file)
        except OSError as error:
            raise InvalidInput(f"{path} cannot be read ({error.strerror}); restore it from a copy") from error
        volts = None if record.volts_v is None else MirrorVolts(x_v=record.volts_v[0], y_v=record.volts_v[1])
        return Frame(
            image=decode(content, what=str(path)),
            role=record.role,
            seq=record.seq,
            t_ns=record.t_ns,
            exposure_ns=record.exposure_ns,
            bits=record.bits,
            volts=volts,
            epoch=record.epoch,
            binning=record.binning,
        )

    def _missing(self, role: Role, bracket: int, more: str) -> InvalidInput:
        have = ", ".join(f"{frame.role.value} b{frame.bracket} s{frame.stack}" for frame in self.frames)
        return InvalidInput(
            f"point {self.index} in {self._folder} has no {role.value} frame of bracket {bracket}{more}; "
            f"it has {have}"
        )


class Dataset:
    """The captured points of a dataset: `ds[i]` counts captured points, `ds[i].index` counts the plan's.

    A dataset that is being written shows the points that were acknowledged when it was opened.
    """

    def __init__(self, folder: Path, document: DatasetDocument, records: tuple[PointRecord, ...]) -> None:
        self._folder, self._document, self._records = folder, document, records
        self._taken = tuple(record for record in records if record.frames)

    @classmethod
    def open(cls, path: str | Path) -> Self:
        """Open a dataset for reading; raise InvalidInput for a missing, damaged or newer one."""
        folder = Path(path)
        document = read_document(folder)
        if document.state is DatasetState.RUNNING and not is_being_written(folder):
            document = document.with_state(DatasetState.PARTIAL, INTERRUPTED)
        return cls(folder, document, read_journal(folder, dataset_id=document.header.id).records)

    @property
    def folder(self) -> Path:
        """The dataset's folder."""
        return self._folder

    @property
    def document(self) -> DatasetDocument:
        """Its description: plan, rig, conditions, licence, state."""
        return self._document

    @property
    def calibration(self) -> Calibration | None:
        """The calibration in use during the capture."""
        return self._document.header.calibration

    @property
    def skipped(self) -> dict[int, str]:
        """Indices of the plan's points that were skipped, with the reasons."""
        return {record.place.index: record.skipped for record in self._records if not record.frames}

    @property
    def scans(self) -> tuple[int, ...]:
        """Numbers of the scans that have points."""
        return tuple(sorted({record.place.scan for record in self._taken}))

    def scan(self, number: int) -> "Dataset":
        """Return the points of one scan as a dataset."""
        if number not in self.scans:
            raise InvalidInput(f"{self._folder} has no scan {number}; its scans are {list(self.scans)}")
        return self._with(tuple(record for record in self._records if record.place.scan == number))

    def __len__(self) -> int:
        return len(self._taken)

    @overload
    def __getitem__(self, index: int) -> DatasetPoint: ...

    @overload
    def __getitem__(self, index: slice) -> "Dataset": ...

    def __getitem__(self, index: int | slice) -> "DatasetPoint | Dataset":
        if isinstance(index, slice):
            return self._with(self._taken[index])
        return DatasetPoint(self._folder, self._taken[index], self.calibration)

    def __iter__(self) -> Iterator[DatasetPoint]:
        return (self[index] for index in range(len(self)))

    def _with(self, records: tuple[PointRecord, ...]) -> "Dataset":
        return Dataset(self._folder, self._document, records)
