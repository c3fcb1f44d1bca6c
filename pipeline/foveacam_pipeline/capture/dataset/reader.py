"""Reads a dataset: `Dataset.open(path)[i].left`. Images are read when asked for; nothing is written."""

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
from foveacam_pipeline.capture.dataset.lock import is_held
from foveacam_pipeline.capture.dataset.values import DatasetState, FrameRecord, PlanPosition, PointRecord
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.stereo.rectify import rectify
from foveacam_pipeline.stereo.values import RectifiedPair

INTERRUPTED = "interrupted: the program that wrote it ended without closing it; resume it"


@dataclass(frozen=True, slots=True, kw_only=True)
class PointPose:
    """How the rig stood at a point: gazes (ax, ay), rad, and volts of both eyes; None where not known."""

    left_rad: tuple[float, float] | None
    right_rad: tuple[float, float] | None
    volts: StereoVolts | None
    rail_m: float | None


class DatasetPoint:
    """One point of a dataset. `left`, `right`, `wide`: the first frame of the first bracket, as taken."""

    def __init__(self, folder: Path, record: PointRecord, calibration: Calibration | None) -> None:
        self._folder, self._record, self._calibration = folder, record, calibration

    @property
    def place(self) -> PlanPosition:
        """Where it stands in the plan."""
        return self._record.place

    @property
    def index(self) -> int:
        """Its number in the plan."""
        return self._record.place.index

    @property
    def frames(self) -> tuple[FrameRecord, ...]:
        """What is kept of its frames."""
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
        """The exposures of the foveae, by number."""
        return tuple(sorted({frame.bracket for frame in self.frames if frame.role is not Role.WIDE}))

    @property
    def pose(self) -> PointPose:
        """How the rig stood during the first exposure."""
        left, right = self._find(Role.LEFT, 0), self._find(Role.RIGHT, 0)
        return PointPose(
            left_rad=left[0].gaze_rad if left else None,
            right_rad=right[0].gaze_rad if right else None,
            volts=self._volts(0),
            rail_m=self.place.rail_m,
        )

    def frame(self, role: Role, *, bracket: int = 0, stack: int = 0) -> Frame:
        """Read one frame, as the camera gave it."""
        for kept in self._find(role, bracket):
            if kept.stack == stack:
                return self._read(kept)
        raise self._missing(role, bracket, f", frame {stack} of its stack")

    def stacked(self, role: Role, *, bracket: int = 0) -> Frame:
        """Return the mean of a stack as one frame of 16 bits, the first one's facts; one alone as it is."""
        kept = self._find(role, bracket)
        if not kept:
            raise self._missing(role, bracket, "")
        first = self._read(kept[0])
        if len(kept) == 1:
            return first
        total = np.zeros(first.image.shape, dtype=np.float64)
        for each in kept:
            total += self._read(each).image
        scale = 2.0 ** (16 - first.bits) / len(kept)
        mean: NDArray[np.uint16] = np.rint(np.minimum(total * scale, 65535.0)).astype(np.uint16)
        return replace(first, image=mean, bits=16)

    def rectified(self, *, scale: float = 0.5, bracket: int = 0) -> RectifiedPair:
        """Return the rectified pair, made now by the dataset's calibration; scale 0.5 or 1.0."""
        if self._calibration is None:
            raise NotCalibrated(
                f"point {self.index} in {self._folder}: the dataset has no calibration; "
                "calibrate before a capture"
            )
        return rectify(self.sighting(bracket=bracket), self._calibration, scale=scale)

    def sighting(self, *, bracket: int = 0) -> Sighting:
        """Return both foveae as one look; where there is no wide frame the left one stands in for it."""
        volts = self._volts(bracket)
        if volts is None:
            raise InvalidInput(
                f"point {self.index} in {self._folder}: the volts of its mirrors are not known"
            )
        left, right = (self.stacked(role, bracket=bracket) for role in (Role.LEFT, Role.RIGHT))
        wide = self.frame(Role.WIDE) if self._find(Role.WIDE, 0) else left
        return Sighting(left=left, right=right, wide=wide, volts=volts)

    def _volts(self, bracket: int) -> StereoVolts | None:
        """Return the mean drive of either mirror over the stack of a bracket."""
        means = []
        for role in (Role.LEFT, Role.RIGHT):
            known = [kept.volts_v for kept in self._find(role, bracket) if kept.volts_v is not None]
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
        found = [kept for kept in self.frames if kept.role is role and kept.bracket == bracket]
        return sorted(found, key=lambda kept: kept.stack)

    def _read(self, kept: FrameRecord) -> Frame:
        path = self._folder / kept.file
        try:
            content = path.read_bytes()
        except OSError as error:
            raise InvalidInput(f"{path} cannot be read ({error.strerror}); restore it from a copy") from error
        volts = None if kept.volts_v is None else MirrorVolts(x_v=kept.volts_v[0], y_v=kept.volts_v[1])
        return Frame(
            image=decode(content, what=str(path)),
            role=kept.role,
            seq=kept.seq,
            t_ns=kept.t_ns,
            exposure_ns=kept.exposure_ns,
            bits=kept.bits,
            volts=volts,
            epoch=kept.epoch,
        )

    def _missing(self, role: Role, bracket: int, more: str) -> InvalidInput:
        have = ", ".join(f"{kept.role.value} b{kept.bracket} s{kept.stack}" for kept in self.frames)
        return InvalidInput(
            f"point {self.index} in {self._folder} has no {role.value} frame of bracket {bracket}{more}; "
            f"it has {have}"
        )


class Dataset:
    """The points of a dataset that were taken; `ds[i]` counts those, `ds[i].index` the plan's.

    A dataset that is being written shows the points acknowledged when it was opened.
    """

    def __init__(self, folder: Path, document: DatasetDocument, records: tuple[PointRecord, ...]) -> None:
        self._folder, self._document, self._records = folder, document, records
        self._taken = tuple(record for record in records if record.frames)

    @classmethod
    def open(cls, path: str | Path) -> Self:
        """Open a dataset to read it; raise InvalidInput when it is none, damaged, or of a newer version."""
        folder = Path(path)
        document = read_document(folder)
        if document.state is DatasetState.RUNNING and not is_held(folder):
            document = document.ended(DatasetState.PARTIAL, INTERRUPTED)
        return cls(folder, document, read_journal(folder, dataset_id=document.header.id).records)

    @property
    def folder(self) -> Path:
        """Where it lies."""
        return self._folder

    @property
    def document(self) -> DatasetDocument:
        """What it says of itself: plan, rig, conditions, licence, state."""
        return self._document

    @property
    def calibration(self) -> Calibration | None:
        """The calibration in force when it was taken."""
        return self._document.header.calibration

    @property
    def skipped(self) -> dict[int, str]:
        """Points of the plan that were passed over, and why."""
        return {record.place.index: record.skipped for record in self._records if not record.frames}

    @property
    def scans(self) -> tuple[int, ...]:
        """Numbers of the scans that it has points of."""
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
