"""Draws random scenes about the point on which both foveae verge: shapes, textures, depths, light.

Scenes to train on and held-out ones have disjoint seeds, families of textures and ranges of parameters.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from foveacam_hardware.contract import CameraSettings, Role
from foveacam_hardware.sim.cameras import default_settings
from foveacam_hardware.sim.scenes.format import (
    BoxObject,
    ColumnObject,
    LightTable,
    Object,
    QuadObject,
    SceneFile,
    SphereObject,
    StatueObject,
)
from foveacam_hardware.sim.scenes.materials import (
    CharucoMaterial,
    CheckerboardMaterial,
    MarkerMaterial,
    Material,
    NoiseMaterial,
    PlainMaterial,
    PrintMaterial,
)
from foveacam_hardware.sim.sensor import supported_settings
from foveacam_pipeline.learn.pair_folder import Split

SEED_BITS = 47
NEAREST_M, FARTHEST_M = 3.0, 20.0
"""Range of the depth on which both foveae verge."""
LAST_M = 60.0
LARGEST_AX_DEG, LARGEST_AY_DEG = 6.5, 5.0
FIELD = 0.05
"""Width of a fovea's view as a share of the distance (2.86 degrees)."""
BASELINE_M = 0.2
LARGEST_RESIDUAL = 0.09
"""Largest residual disparity of objects, in widths of the view: 128 px of 1440."""
OBJECTS = (4, 16)
BLANK_SHARE, REPEATED_SHARE, BAR_SHARE, PRINT_SHARE = 0.08, 0.18, 0.4, 0.15
STRETCH = {Split.TRAIN: (1.0, 4.0), Split.HELD_OUT: (6.0, 20.0)}
"""Ranges of the stretch of noise textures: training scenes look like stone and cloth, held-out ones like
wood."""
LETTERS = "ABCDEFGHKLMNPRSTUVXYZ|/#"
DRIFT_S = 300.0
"""Longest time from the calibration to a look, in which the mounts drift as in real looks."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PairScene:
    """A scene, the verged point, the settings of both eyes' cameras, and the time since the calibration."""

    file: SceneFile
    ax_rad: float
    ay_rad: float
    z_m: float
    cameras: dict[Role, CameraSettings]
    age_s: float


def scene_seed(seed: int, split: Split, index: int) -> int:
    """Return the seed of a pair's scene; seeds of the two splits are disjoint for any seed of the stream."""
    drawn = np.random.default_rng([seed, index]).integers(1 << SEED_BITS)
    return 2 * int(drawn) + (split is Split.HELD_OUT)


def draw_scene(seed: int) -> PairScene:
    """Return the scene of a seed, as `scene_seed` gives it."""
    rng = np.random.default_rng(seed)
    ax_rad, ay_rad = np.deg2rad(rng.uniform(-1.0, 1.0, 2) * (LARGEST_AX_DEG, LARGEST_AY_DEG)).tolist()
    z_m = float(1.0 / rng.uniform(1.0 / FARTHEST_M, 1.0 / NEAREST_M))
    drawing = _Drawing(rng, Split.HELD_OUT if seed % 2 else Split.TRAIN, (ax_rad, ay_rad), z_m)
    drawing.add_background()
    for _ in range(int(rng.integers(*OBJECTS))):
        drawing.add_object()
    if rng.random() < BAR_SHARE:
        drawing.add_bars()
    return PairScene(
        file=drawing.scene_file(),
        ax_rad=ax_rad,
        ay_rad=ay_rad,
        z_m=z_m,
        cameras=_cameras(rng),
        age_s=float(rng.uniform(0.0, DRIFT_S)),
    )


class _Drawing:
    """The objects and materials drawn so far."""

    def __init__(
        self, rng: np.random.Generator, split: Split, gaze_rad: tuple[float, float], z_m: float
    ) -> None:
        self._rng, self._split, self._z_m = rng, split, z_m
        self._slope = np.tan(gaze_rad)
        self._materials: dict[str, Material] = {}
        self._objects: list[Object] = []

    def scene_file(self) -> SceneFile:
        """Return the scene, with a random light."""
        rng = self._rng
        x, z = rng.uniform(-1.0, 1.0), rng.uniform(-1.0, -0.2)
        light = LightTable(
            towards=(float(x), -0.8, float(z)),
            ambient=float(rng.uniform(0.4, 0.9)),
            horizon=self._color(0.4, 0.8),
            zenith=self._color(0.2, 0.7),
        )
        return SceneFile(
            format="foveacam-scene",
            version=1,
            title="random",
            light=light,
            materials=self._materials,
            objects=self._objects,
        )

    def add_background(self) -> None:
        """Add a slanted wall behind everything, and often a floor or a ceiling up to it."""
        rng = self._rng
        z_m = self._depth_m(rng.uniform(-0.12, -0.015))
        turn = rng.uniform(-50.0, 50.0, 2) * rng.integers(0, 2, 2)
        self._add_quad(self._at(z_m, (0.0, 0.0)), (4.0 * FIELD * z_m,) * 2, z_m, (*turn, 0.0))
        if rng.random() < 0.5:
            side, near_m = (1.0 if rng.random() < 0.7 else -1.0), self._depth_m(0.08)
            y = side * float(rng.uniform(0.1, 0.4))
            size = (4.0 * FIELD * z_m, 1.3 * (z_m - near_m))
            self._add_quad(self._at((z_m + near_m) / 2.0, (0.0, y)), size, z_m, (90.0 * side, 0.0, 0.0))

    def add_object(self) -> None:
        """Add an object of any shape at a random depth, somewhere in view."""
        rng = self._rng
        z_m = self._depth_m(float(np.clip(rng.normal(0.0, 0.035), -LARGEST_RESIDUAL, LARGEST_RESIDUAL)))
        place = self._at(z_m, rng.uniform(-0.55, 0.55, 2) * (1.0, 0.75))
        size_m = float(np.exp(rng.uniform(np.log(0.06), np.log(0.6)))) * FIELD * z_m
        self._objects.append(self._shape(place, size_m, z_m))

    def add_bars(self) -> None:
        """Add thin parallel bars of one material, equally spaced: a fence, a grille, or a single pole."""
        rng = self._rng
        z_m = self._depth_m(rng.uniform(0.0, LARGEST_RESIDUAL))
        width_m = FIELD * z_m
        material = self._material(z_m)
        across = rng.uniform(0.03, 0.12)
        first, radius_m = rng.uniform(-0.5, 0.3), float(rng.uniform(0.002, 0.008)) * width_m
        tilt = float(rng.normal(0.0, 15.0)) + (90.0 if rng.random() < 0.2 else 0.0)
        for number in range(int(rng.integers(1, 8))):
            self._objects.append(
                ColumnObject(
                    shape="column",
                    name=f"bar {number}",
                    material=material,
                    position_m=self._at(z_m, (first + number * across, rng.uniform(-0.1, 0.1))),
                    rotation_deg=(0.0, 0.0, tilt),
                    radius_m=radius_m,
                    height_m=float(rng.uniform(0.4, 1.6)) * width_m,
                    sides=8,
                )
            )

    def _shape(self, place: tuple[float, float, float], size_m: float, z_m: float) -> Object:
        rng = self._rng
        a, b, c = (size_m * rng.uniform(0.3, 1.0, 3)).tolist()
        given = {
            "name": f"object {len(self._objects)}",
            "material": self._material(z_m),
            "position_m": place,
            "rotation_deg": tuple(rng.uniform(-60.0, 60.0, 3).tolist()),
        }
        match int(rng.choice(5, p=(0.34, 0.3, 0.16, 0.15, 0.05))):
            case 0:
                return QuadObject.model_validate({**given, "shape": "quad", "size_m": (a, b)})
            case 1:
                return BoxObject.model_validate({**given, "shape": "box", "size_m": (a, b, c)})
            case 2:
                return SphereObject.model_validate({**given, "shape": "sphere", "radius_m": a / 2.0})
            case 3:
                size = {"radius_m": a / 4.0, "height_m": 2.0 * b}
                return ColumnObject.model_validate({**given, "shape": "column", **size})
        return StatueObject.model_validate({**given, "shape": "statue", "height_m": size_m, "triangles": 800})

    def _add_quad(
        self,
        place: tuple[float, float, float],
        size_m: tuple[float, float],
        z_m: float,
        turn_deg: tuple[float, float, float],
    ) -> None:
        self._objects.append(
            QuadObject(
                shape="quad",
                name=f"object {len(self._objects)}",
                material=self._material(z_m),
                position_m=place,
                rotation_deg=turn_deg,
                size_m=size_m,
            )
        )

    def _at(self, z_m: float, off: ArrayLike) -> tuple[float, float, float]:
        """Return the point (3,) at a depth, `off` from the gaze in widths of the view."""
        x, y = ((self._slope + FIELD * np.asarray(off)) * z_m).tolist()
        return x, y, z_m

    def _depth_m(self, residual: float) -> float:
        """Return the depth of a residual disparity in widths of the view; at most LAST_M."""
        return float(1.0 / max(1.0 / self._z_m + residual * FIELD / BASELINE_M, 1.0 / LAST_M))

    def _material(self, z_m: float) -> str:
        name = f"material {len(self._materials)}"
        self._materials[name] = self._surface(FIELD * z_m)
        return name

    def _surface(self, width_m: float) -> Material:
        """Return a surface whose details suit a view of this width."""
        rng = self._rng
        kind = float(rng.random())
        if kind < BLANK_SHARE:
            return PlainMaterial(kind="plain", color=self._color(0.2, 0.9))
        if kind < BLANK_SHARE + REPEATED_SHARE:
            return self._repeated(width_m)
        printed = any(isinstance(given, PrintMaterial) for given in self._materials.values())
        if self._split is Split.TRAIN and not printed and kind > 1.0 - PRINT_SHARE / OBJECTS[0]:
            return self._print(width_m)
        return self._noise(width_m)

    def _noise(self, width_m: float) -> NoiseMaterial:
        rng = self._rng
        coarsest_m = float(np.exp(rng.uniform(np.log(0.03), np.log(0.8)))) * width_m
        return NoiseMaterial(
            kind="noise",
            color=self._color(0.02, 0.5),
            accent=self._color(0.4, 0.98),
            contrast=float(np.exp(rng.uniform(np.log(0.2), np.log(3.0)))),
            coarsest_m=coarsest_m,
            finest_m=coarsest_m * float(rng.uniform(0.004, 0.06)),
            stretch=float(rng.uniform(*STRETCH[self._split])),
            seed=2 * int(rng.integers(1 << 30)) + (self._split is Split.HELD_OUT),
        )

    def _repeated(self, width_m: float) -> Material:
        """Return a checkerboard to train on; a board or a marker for held-out scenes."""
        rng = self._rng
        square_m = float(np.exp(rng.uniform(np.log(0.008), np.log(0.08)))) * width_m
        dark, light = self._color(0.0, 0.3), self._color(0.5, 0.98)
        if self._split is Split.TRAIN:
            columns, rows = (int(n) for n in rng.integers(4, 65, 2))
            return CheckerboardMaterial(
                kind="checkerboard", columns=columns, rows=rows, square_m=square_m, color=light, accent=dark
            )
        if rng.random() < 0.5:
            number = int(rng.integers(50))
            return MarkerMaterial(kind="aruco", id=number, side_m=4.0 * square_m, color=light, accent=dark)
        columns, rows = (int(n) for n in rng.integers(4, 11, 2))
        return CharucoMaterial(
            kind="charuco", columns=columns, rows=rows, square_m=2.0 * square_m, color=light, accent=dark
        )

    def _print(self, width_m: float) -> PrintMaterial:
        rng = self._rng
        letters = rng.choice(list(LETTERS), size=(int(rng.integers(1, 5)), int(rng.integers(3, 13))))
        side_m = float(rng.uniform(0.2, 0.8)) * width_m
        return PrintMaterial(
            kind="print",
            text="\n".join("".join(line) for line in letters),
            width_m=side_m,
            height_m=side_m * float(rng.uniform(0.4, 1.0)),
            color=self._color(0.5, 0.98),
            accent=self._color(0.0, 0.4),
        )

    def _color(self, low: float, high: float) -> tuple[float, float, float]:
        red, green, blue = self._rng.uniform(low, high, 3).tolist()
        return red, green, blue


def _cameras(rng: np.random.Generator) -> dict[Role, CameraSettings]:
    """Return settings of both foveae: different gains, compensated by the exposures to within a quarter."""
    brightness, chosen = rng.uniform(0.5, 1.2), {}
    black_level = float(rng.integers(1, 5)) if rng.random() < 0.25 else 0.0
    for role in (Role.LEFT, Role.RIGHT):
        settings, gain_db = default_settings(role), float(rng.uniform(0.0, 12.0))
        factor = brightness * rng.uniform(0.85, 1.15) / 10.0 ** (gain_db / 20.0)
        chosen[role] = supported_settings(
            role,
            replace(
                settings,
                exposure_ns=round(settings.exposure_ns * factor),
                gain_db=gain_db,
                black_level=black_level,
            ),
        )
    return chosen
