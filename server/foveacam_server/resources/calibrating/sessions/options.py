"""Options of the calibration steps, validated for REST and the command line."""

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from foveacam_pipeline.calibrate.wide.dictionary_names import DictionaryName

Label = Annotated[str, Field(min_length=1, max_length=80, pattern=r"^[^\x00-\x1f\x7f]*$")]
Name = Annotated[str, Field(min_length=1, max_length=60)]
LensModel = Literal["five", "rational"]
Nodes = Annotated[int, Field(ge=3, le=41)]
Extent = Annotated[float, Field(gt=0.0, le=12.0)]


class _Options(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False, frozen=True)


class BoardOption(_Options):
    """The calibration board: inner corners, side of a square.

    Of a ChArUco board also the side of a marker, the markers' dictionary, and whether it is drawn as OpenCV
    did before 4.6 (`legacy_pattern`: an even number of squares downwards begins with a white one).
    """

    kind: Literal["charuco", "checkerboard"] = "charuco"
    columns: Annotated[int, Field(ge=3, le=40)] = 9
    rows: Annotated[int, Field(ge=3, le=40)] = 6
    square_mm: Annotated[float, Field(gt=0.0, le=1000.0)]
    marker_mm: Annotated[float, Field(gt=0.0, le=1000.0)] | None = None
    dictionary: DictionaryName = "4X4_50"
    legacy_pattern: bool = False


class WideOptions(_Options):
    """Stage 1; `views`: number to take, `model`: lens model to use, `station`: where the board is shown."""

    station: Name | None = None
    board: BoardOption | None = None
    views: Annotated[int, Field(ge=3, le=200)] | None = None
    model: LensModel | None = None


class LensOptions(_Options):
    """The lens of a fovea with its mirror at rest; `views`: number to take.

    `station`: where a board that fits its field is shown; without one, a station whose name contains `fovea`,
    else the rig is not turned.
    """

    camera: Literal["left", "right"]
    station: Name | None = None
    board: BoardOption | None = None
    views: Annotated[int, Field(ge=3, le=200)] | None = None


class MirrorsOptions(_Options):
    """Stage 2: stations, nodes and extent of the sweep; `restart`: set earlier sweeps aside."""

    stations: Annotated[list[Name], Field(min_length=1, max_length=16)] | None = None
    nodes: Annotated[list[Nodes], Field(min_length=2, max_length=2)] | None = None
    extent_ax_deg: Extent | None = None
    extent_ay_deg: Extent | None = None
    spacing: Literal["rim", "even"] | None = None
    restart: bool = False


class FitOptions(_Options):
    """The fit of stages 2 and 3.

    `order`, `field_order`: of the mirrors' and the rectification's polynomials; null: chosen by scores.
    `pose_by_pose`: the paper's rectification. `distance`: source of the markers' distance. `compare`:
    score each of our additions to the paper's model.
    """

    label: Label | None = None
    order: Annotated[int, Field(ge=1, le=9)] | None = None
    use_all_distances: bool = True
    field_order: Annotated[int, Field(ge=1, le=5)] | None = None
    pose_by_pose: bool = False
    distance: Literal["print", "tape", "unknown"] = "print"
    compare: bool = True


class CheckOptions(_Options):
    """Number of poses outside the sweep to measure."""

    poses: Annotated[int, Field(ge=2, le=200)] | None = None


class SettleOptions(_Options):
    """`apply`: put the measured settle time in use, now and at every start."""

    apply: bool = False


class AllOptions(_Options):
    """All steps in order; `activate`: put the result in force.

    `apply_settle`: also put the measured settle time in use.
    """

    wide: WideOptions = WideOptions()
    mirrors: MirrorsOptions = MirrorsOptions()
    fit: FitOptions = FitOptions()
    check: CheckOptions = CheckOptions()
    settle: bool = True
    apply_settle: bool = True
    activate: bool = False


class WideRun(_Options):
    """Measure the wide camera, or add views to those measured."""

    step: Literal["wide"]
    options: WideOptions = WideOptions()


class LensRun(_Options):
    """Measure the lens of a fovea, or add views to those taken; no other step needs it."""

    step: Literal["lens"]
    options: LensOptions


class MirrorsRun(_Options):
    """Sweep the mirrors, or continue an interrupted sweep."""

    step: Literal["mirrors"]
    options: MirrorsOptions = MirrorsOptions()


class FitRun(_Options):
    """Fit a calibration to the session's measurements."""

    step: Literal["fit"]
    options: FitOptions = FitOptions()


class CheckRun(_Options):
    """Check the fitted calibration at poses that no sweep visited."""

    step: Literal["check"]
    options: CheckOptions = CheckOptions()


class SettleRun(_Options):
    """Measure the mirrors' settle time."""

    step: Literal["settle"]
    options: SettleOptions = SettleOptions()


class AllRun(_Options):
    """Run all steps of a calibration."""

    step: Literal["all"]
    options: AllOptions = AllOptions()


Run = Annotated[
    WideRun | LensRun | MirrorsRun | FitRun | CheckRun | SettleRun | AllRun, Field(discriminator="step")
]
STEPS = ("wide", "lens", "mirrors", "fit", "check", "settle", "all")
