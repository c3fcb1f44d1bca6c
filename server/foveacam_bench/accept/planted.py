"""The faults that are planted into a simulated rig for its acceptance, and what must be named for each."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib.resources import files
from pathlib import Path
from typing import Any

from foveacam_pipeline.accept.values import Fault

PRINT_SCALE = 0.98
"""Of a print that was fitted to the page."""
TAPE_SCALE = 1.02


@dataclass(frozen=True, slots=True, kw_only=True)
class PlantedFault:
    """One planted fault. `rig`: keys of the rig file; `named`: what must be named, and nothing else.

    `printed_scale`, `taped_scale`: of the markers, and of the distance to the farther ones.
    """

    name: str
    named: tuple[Fault, str]
    rig: Mapping[str, Any] = field(default_factory=dict)  # Any: as a rig file holds it
    printed_scale: float = 1.0
    taped_scale: float = 1.0

    def rig_file(self, folder: Path) -> dict[str, Any]:  # Any: as a rig file holds it
        """Return the content of the rig file; a scene that differs is written into `folder`."""
        if self.printed_scale == self.taped_scale == 1.0:
            return {"scene": "calibration", **self.rig}
        path = folder / f"{self.name}.toml"
        path.write_text(_scene(printed_scale=self.printed_scale, taped_scale=self.taped_scale))
        return {"scene": str(path), **self.rig}


def _assembly(name: str, fault: Fault, subject: str, **tables: object) -> PlantedFault:
    return PlantedFault(name=name, named=(fault, subject), rig={"assembly": tables})


def _faults(name: str, fault: Fault, subject: str, **tables: object) -> PlantedFault:
    return PlantedFault(name=name, named=(fault, subject), rig={"faults": tables})


PLANTED: tuple[PlantedFault, ...] = (
    _faults("wide camera unplugged", Fault.MISSING_DEVICE, "wide", unplugged=["wide"]),
    _faults("no trigger cable, left", Fault.NO_TRIGGER, "left", no_trigger=["left"]),
    _faults("no strobe cable, right", Fault.NO_STROBE, "right", no_strobe=["right"]),
    _faults("frozen picture, right", Fault.FROZEN_PICTURE, "right", frozen=["right"]),
    _faults("stuck axis, left y", Fault.STUCK_AXIS, "left y", dead_axes=["left y"]),
    _faults("left eye knocked by 0.1°", Fault.MOVED_EYE, "left", knocked_left={"shift_x_deg": 0.1}),
    _faults("right eye knocked by 4°", Fault.MARKER_NOT_SEEN, "right", knocked_right={"shift_y_deg": 4.0}),
    _assembly(
        "left and right cameras exchanged",
        Fault.EXCHANGED_CAMERAS,
        "left and right",
        exchanged_cameras=["left", "right"],
    ),
    _assembly(
        "wide and left cameras exchanged",
        Fault.EXCHANGED_CAMERAS,
        "left and wide",
        exchanged_cameras=["wide", "left"],
    ),
    _assembly("mirrored picture, left", Fault.MIRRORED_PICTURE, "left", left={"mirrored": True}),
    _assembly("mirrored picture, wide", Fault.MIRRORED_PICTURE, "wide", wide={"mirrored": True}),
    _assembly("upside down, right", Fault.ROTATED_PICTURE, "right", right={"upside_down": True}),
    _assembly("upside down, wide", Fault.ROTATED_PICTURE, "wide", wide={"upside_down": True}),
    _assembly("mirrors exchanged", Fault.EXCHANGED_MIRRORS, "left and right", exchanged_mirrors=True),
    _assembly("axes exchanged, right", Fault.EXCHANGED_AXES, "right", right={"exchanged_axes": True}),
    _assembly("x reversed, left", Fault.REVERSED_AXIS, "left x", left={"reversed_axes": ["x"]}),
    _assembly("y reversed, right", Fault.REVERSED_AXIS, "right y", right={"reversed_axes": ["y"]}),
    _assembly("supply at 90 %", Fault.WEAK_DRIVE, "left and right", drive_scale=0.9),
    _assembly("late strobe, left", Fault.LATE_STROBE, "left", left={"strobe_delay_us": 600}),
    _assembly("late exposure, right", Fault.LATE_EXPOSURE, "right", right={"exposure_delay_us": 700}),
    _assembly("filter at half its cut-off", Fault.SLOW_FILTER, "", filter_scale=0.5),
    _assembly("controller's clock 800 ppm fast", Fault.CONTROLLER_CLOCK, "", controller_clock_ppm=800.0),
    _assembly("2 px defocus, left", Fault.DEFOCUS, "left", left={"defocus_px": 2.0}),
    _assembly("2 px defocus, wide", Fault.DEFOCUS, "wide", wide={"defocus_px": 2.0}),
    _assembly("hot pixels, right", Fault.HOT_PIXELS, "right", right={"hot_fraction": 4e-4}),
    _assembly("black level +12, left", Fault.BLACK_LEVEL, "left", left={"black_level": 12.0}),
    _assembly("black level -8, wide", Fault.BLACK_LEVEL, "wide", wide={"black_level": -8.0}),
    _assembly("noise, right", Fault.NOISE, "right", right={"noise": 3.0}),
    _assembly("left eye darker", Fault.DARK_EYE, "left", left={"transmission": 0.6}),
    _assembly("vignetting, right", Fault.VIGNETTING, "right", right={"vignetting": 0.5}),
    _assembly("vignetting, wide", Fault.VIGNETTING, "wide", wide={"vignetting": 0.5}),
    _assembly("four bits lost, left", Fault.PIXEL_FORMAT, "left", left={"lost_bits": 4}),
    _assembly("mosaic as grey, wide", Fault.PIXEL_FORMAT, "wide", wide={"bayer_as_grey": True}),
    _assembly("5 % of the frames lost, left", Fault.LOST_FRAMES, "left", left={"lost_frames": 0.05}),
    _assembly("2 % of the frames lost, wide", Fault.LOST_FRAMES, "wide", wide={"lost_frames": 0.02}),
    _assembly("loose mount, left", Fault.LOOSE_MOUNT, "left", left={"loose_mount_deg": 0.02}),
    _assembly(
        "mount that creeps, right", Fault.MOUNT_DRIFT, "right", right={"mount_drift_deg_per_min": 0.02}
    ),
    PlantedFault(
        name="hysteresis 0.02°",
        named=(Fault.HYSTERESIS, ""),
        rig={"mirror_disturbance": {"hysteresis_deg": 0.02}},
    ),
    PlantedFault(
        name="scatter 0.05°", named=(Fault.SCATTER, ""), rig={"mirror_disturbance": {"scatter_rms_deg": 0.05}}
    ),
    _assembly("baseline 1 % longer", Fault.BASELINE, "", baseline_scale=1.01),
    PlantedFault(name="markers printed at 98 %", named=(Fault.PRINTED_SCALE, ""), printed_scale=PRINT_SCALE),
    PlantedFault(
        name="tape read 2 % too long", named=(Fault.TAPED_DISTANCE, "markers"), taped_scale=TAPE_SCALE
    ),
)


def _scene(*, printed_scale: float, taped_scale: float) -> str:
    """Return the calibration scene with markers of another print, or with another taped distance."""
    text = files("foveacam_hardware.sim.scenes").joinpath("calibration.toml").read_text(encoding="utf-8")
    text = text.replace("distance_m = 5\n", f"distance_m = {5 * taped_scale:g}\n")
    if printed_scale == 1.0:
        return text
    text = re.sub(r"side_m=0\.06\b", f"side_m={0.06 * printed_scale:g}", text)
    return re.sub(r"(?s)(name = \"(far|near) (left|centre|right)\".*?)(?=\n\n)", _moved(printed_scale), text)


def _moved(printed_scale: float) -> Any:  # noqa: ANN401 - the replacement of re.sub
    """Return what moves a marker's table towards the centre of its sheet."""
    centres = {"far": (0.0, 0.0, 5.0), "near": (-1.79252, 0.0, 1.75752)}

    def move(found: re.Match[str]) -> str:
        centre = centres[found.group(2)]

        def scaled(place: re.Match[str]) -> str:
            values = [float(value) for value in place.group(1).split(",")]
            kept = (c + printed_scale * (v - c) for v, c in zip(values, centre, strict=True))
            return f"position_m = [{', '.join(f'{value:.6f}' for value in kept)}]"

        return re.sub(r"position_m = \[([^\]]*)\]", scaled, found.group(1))

    return move
