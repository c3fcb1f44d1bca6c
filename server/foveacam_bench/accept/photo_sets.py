"""Measures that a stranger's photographs of boards calibrate correctly, or are refused for the right reason.

Each set has one cause of trouble and a camera that is known. `photo_judging.py` judges it by the step that
`foveacam calibrate wide --images` runs.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

from foveacam_bench.accept import photo_files as files
from foveacam_bench.accept.photo_judging import (
    Expected,
    Fits,
    Refused,
    SetOutcome,
    calibrate_folder,
    fault_of,
    field_fault,
    focal_error,
    round_trip_px,
)
from foveacam_bench.accept.photo_pictures import KnownCamera, Series, photographs
from foveacam_bench.figures import Figures, Report
from foveacam_pipeline.models import Intrinsics, load_calibration
from foveacam_server.resources.calibrating.calibrations.service import SHIPPED
from foveacam_server.resources.calibrating.sessions.options import BoardOption, LensModel, WideOptions
from foveacam_server.resources.calibrating.sessions.wide_step import chosen_board

WEBCAM = KnownCamera(
    width=640,
    height=480,
    focal_px=(536.0, 537.5),
    centre_px=(328.4, 236.7),
    distortion=(-0.25, 0.08, 0.0005, -0.0004, -0.01),
)
PHONE = KnownCamera(
    width=960,
    height=720,
    focal_px=(804.0, 804.0),
    centre_px=(474.3, 366.1),
    distortion=(0.09, -0.15, 0.0003, 0.0006, 0.05),
)
ACTION = KnownCamera(
    width=640,
    height=480,
    focal_px=(330.0, 331.0),
    centre_px=(322.0, 241.0),
    distortion=(0.7129, 0.0829, 0.0003, -0.0002, 0.0008, 1.0458, 0.2334, 0.0082),
)
"""Nearly an equidistant fish-eye, 140 degrees wide: bends a near board by half a square."""
FOLDING = KnownCamera(
    width=1280,
    height=960,
    focal_px=(563.8, 564.7),
    centre_px=(652.2, 500.8),
    distortion=(-0.2463, 0.0759, -0.0004, 0.0002, -0.0117),
)
"""A lens as fitted to photographs of an action camera: it folds back inside the corners."""
PUBLISHED = KnownCamera(
    width=640, height=480, focal_px=(536.0, 536.0), centre_px=(335.0, 240.0), distortion=(0.0,) * 5
)
"""The cameras of OpenCV's chessboards, f by its tutorial; the centres differ by some ten pixels."""
EXACT_FOLD = 0.01
"""Relative doubt of the fold of a lens that is given, by the steps of the radii that are tried."""

CHECKERBOARD = BoardOption(kind="checkerboard", columns=9, rows=6, square_mm=25.0)
SQUARES_COUNTED = BoardOption(kind="checkerboard", columns=10, rows=7, square_mm=25.0)
CHARUCO = BoardOption(square_mm=30.0, marker_mm=22.5, dictionary="6X6_250")
OTHER_MARKERS = BoardOption(square_mm=30.0, marker_mm=22.5, dictionary="4X4_50")
LEGACY = BoardOption(rows=7, square_mm=30.0, marker_mm=22.5, legacy_pattern=True)
NOT_LEGACY = BoardOption(rows=7, square_mm=30.0, marker_mm=22.5)
USUAL, FEW, NEAR = Series(), Series(count=4), Series(share=(0.6, 2.0))
LARGE, FEW_LARGE = Series(share=(0.5, 0.8)), Series(count=4, share=(0.5, 0.8))


@dataclass(frozen=True, slots=True, kw_only=True)
class PhotoSet:
    """A folder of photographs and what is to become of it.

    `board` is what they show, `described` what the user says that it is, if another. `folder`: of
    photographs that were taken by others.
    """

    name: str
    expected: Expected
    camera: KnownCamera = WEBCAM
    board: BoardOption = CHECKERBOARD
    described: BoardOption | None = None
    series: Series = USUAL
    write: files.Writer = files.as_png
    pattern: str = "*"
    model: LensModel | None = None
    folder: Path | None = None


SETS: Sequence[PhotoSet] = (
    PhotoSet(name="png", expected=Fits(camera=WEBCAM)),
    PhotoSet(name="jpeg", write=files.as_jpeg, expected=Fits(camera=WEBCAM)),
    PhotoSet(
        name="exif_orientation_6",
        write=partial(files.as_jpeg, orientation=6),
        expected=Fits(camera=WEBCAM, same_as="jpeg"),
    ),
    PhotoSet(
        name="exif_orientation_3",
        write=partial(files.as_jpeg, orientation=3),
        expected=Fits(camera=WEBCAM, same_as="jpeg"),
    ),
    PhotoSet(
        name="ten_bits",
        write=partial(files.as_low_bits, bits=10),
        expected=Fits(camera=WEBCAM, comparable_to="png"),
    ),
    PhotoSet(
        name="twelve_bits",
        write=partial(files.as_low_bits, bits=12),
        expected=Fits(camera=WEBCAM, comparable_to="png"),
    ),
    PhotoSet(name="opacity", write=files.as_transparent, expected=Fits(camera=WEBCAM, same_as="png")),
    PhotoSet(
        name="one_odd_size",
        write=files.with_odd_size,
        expected=Fits(camera=WEBCAM, left_out={files.ODD_SIZE: "480 x 360 px, most are 640 x 480"}),
    ),
    PhotoSet(
        name="broken_files",
        write=files.with_broken_files,
        expected=Fits(
            camera=WEBCAM,
            left_out={
                files.EMPTY: "cannot be read",
                files.TEXT: "cannot be read",
                files.CUT: "cannot be read|board",
                files.WALL: "nothing like a board",
            },
        ),
    ),
    PhotoSet(
        name="empty_pattern", series=FEW, pattern="", expected=Refused(words="pattern ''.*leave it out")
    ),
    PhotoSet(
        name="squares_counted",
        series=FEW,
        described=SQUARES_COUNTED,
        expected=Refused(words="board of 9 x 6 inner corners was found.*columns and rows"),
    ),
    PhotoSet(
        name="grainy",
        series=Series(grain=0.08, blur_px=1.3),
        expected=Fits(camera=WEBCAM, focal_tolerance=0.01, largest_rms_px=1.0),
    ),
    PhotoSet(
        name="curled_paper",
        series=Series(curl=0.25),
        expected=Refused(words=r"corners scatter by \d+\.\d+ px", never="too alike|nothing like"),
    ),
    PhotoSet(
        name="all_alike",
        series=Series(count=20, still=True, share=(0.7, 0.8)),
        expected=Refused(words="too alike"),
    ),
    PhotoSet(name="strong_barrel", camera=ACTION, series=NEAR, expected=Fits(camera=ACTION, known=0.9)),
    PhotoSet(
        name="barrel_near_and_far",
        camera=ACTION,
        series=Series(count=24, seed=2, share=(0.3, 2.0)),
        expected=Fits(camera=ACTION, known=0.9),
    ),
    PhotoSet(
        name="barrel_to_the_corners",
        camera=ACTION,
        series=Series(count=20, seed=2, share=(0.3, 1.5)),
        expected=Fits(camera=ACTION, known=0.85),  # no view shows one of the corners
    ),
    PhotoSet(
        name="folding_corners",
        camera=FOLDING.halved(),
        series=Series(share=(0.3, 0.9)),
        model="five",
        expected=Fits(camera=FOLDING.halved(), views=16),
    ),
    PhotoSet(name="charuco_6x6", camera=PHONE, board=CHARUCO, series=LARGE, expected=Fits(camera=PHONE)),
    PhotoSet(
        name="charuco_other_dictionary",
        camera=PHONE,
        board=CHARUCO,
        described=OTHER_MARKERS,
        series=FEW_LARGE,
        expected=Refused(words=r"dictionary 6X6_\d+.*board of 9 x 6 inner corners"),
    ),
    PhotoSet(
        name="charuco_called_checkerboard",
        camera=PHONE,
        board=CHARUCO,
        described=CHECKERBOARD,
        series=FEW_LARGE,
        expected=Refused(words=r"ChArUco|markers", never="nothing like a board"),
    ),
    PhotoSet(name="legacy_charuco", camera=PHONE, board=LEGACY, series=LARGE, expected=Fits(camera=PHONE)),
    PhotoSet(
        name="legacy_charuco_undeclared",
        camera=PHONE,
        board=LEGACY,
        described=NOT_LEGACY,
        series=FEW_LARGE,
        expected=Refused(words="legacy pattern"),
    ),
)
"""Sets that another is compared with stand before it."""


def photo_set_figures(
    progress: Report, *, data: Path | None = None, sets: Sequence[PhotoSet] = SETS
) -> Figures:
    """Return how many sets behave rightly, and the worst errors; `data`: folder with chessboard/, if any."""
    sets = (*sets, *_real_sets(data))
    outcomes = run_sets(sets, progress)
    faults = faults_of(sets, outcomes)
    faults["folding_lens_as_given"] = field_fault(_as_given(FOLDING), FOLDING, margin=EXACT_FOLD)
    wrong = {name: fault for name, fault in faults.items() if fault}
    fitted = [lens for outcome in outcomes.values() for lens in outcome.lenses]
    shipped = [load_calibration(path).wide for path in sorted(SHIPPED.glob("*.json"))]
    progress("round trips of lenses")
    return {
        "photo_sets": len(faults),
        "photo_sets_right": len(faults) - len(wrong),
        "photo_sets_wrong": list(wrong),
        "photo_set_faults": [f"{name}: {fault}" for name, fault in wrong.items()],
        "inverse_max_px": max(round_trip_px(lens) for lens in (*fitted, *shipped, _as_given(FOLDING))),
        "photo_focal_error_max": _largest_focal_error(sets, outcomes),
    }


def run_sets(sets: Iterable[PhotoSet], progress: Report) -> dict[str, SetOutcome]:
    """Calibrate from each set and return what became of it, by name."""
    outcomes = {}
    for one in sets:
        progress(one.name)
        outcomes[one.name] = _run_set(one)
    return outcomes


def faults_of(sets: Iterable[PhotoSet], outcomes: Mapping[str, SetOutcome]) -> dict[str, str]:
    """Return what is wrong with the outcome of each set, by name; empty if nothing is."""
    return {one.name: fault_of(outcomes[one.name], one.expected, earlier=outcomes) for one in sets}


def _run_set(one: PhotoSet) -> SetOutcome:
    options = WideOptions(board=one.described or one.board, model=one.model)
    if one.folder is not None:
        return calibrate_folder(one.folder, options, pattern=one.pattern)
    with TemporaryDirectory() as name:
        folder = Path(name)
        one.write(folder, photographs(one.camera, chosen_board(one.board, None), one.series))
        return calibrate_folder(folder, options, pattern=one.pattern)


def _real_sets(data: Path | None) -> Sequence[PhotoSet]:
    """Return the sets of OpenCV's chessboards in a folder, if it has them."""
    folder = None if data is None else data / "chessboard"
    if folder is None or not folder.is_dir():
        return ()
    fits = Fits(
        camera=PUBLISHED,
        focal_tolerance=0.01,
        centre_tolerance=0.03,
        known=0.95,  # nine views leave some corners of the picture out
        largest_rms_px=0.5,
        views=9,
        published=True,
    )
    return [
        PhotoSet(name=f"real_{side}", folder=folder, pattern=f"{side}*", expected=fits)
        for side in ("left", "right")
    ]


def _largest_focal_error(sets: Iterable[PhotoSet], outcomes: Mapping[str, SetOutcome]) -> float | None:
    """Return the largest relative error of the focal length over sets that fit a camera known exactly."""
    errors = [
        focal_error(outcomes[one.name].lenses[0], one.expected.camera)
        for one in sets
        if isinstance(one.expected, Fits) and not one.expected.published and outcomes[one.name].lenses
    ]
    return max(errors, default=None)


def _as_given(camera: KnownCamera) -> Intrinsics:
    """Return a known camera as the product's intrinsics."""
    return Intrinsics(
        width=camera.width,
        height=camera.height,
        fx_px=camera.focal_px[0],
        fy_px=camera.focal_px[1],
        cx_px=camera.centre_px[0],
        cy_px=camera.centre_px[1],
        distortion=camera.distortion,
    )
