"""Lists the benches by name with their durations, runs one, and shows its figures as a table."""

import inspect
import shutil
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

from rich.table import Table

from foveacam_bench.figures import Figures
from foveacam_bench.progress import duration_text, show_part, shown_progress
from foveacam_hardware.contract import InvalidInput, NotConnected, install_command

QUICK_BINNING = 2
QUICK_S = 90
"""What a quick run is meant to take at most, on two cores that nothing else uses."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Bench:
    """A bench. `module`: below foveacam_bench; its `run` returns the figures by name.

    `whole_s`: from and to what a whole run takes on two cores. `needs`: packages and programs without which
    there is no figure; `uses`: those without which some are null.
    """

    module: str
    whole_s: tuple[int, int]
    needs: tuple[str, ...] = ()
    uses: tuple[str, ...] = ()


ARAVIS = "arv-fake-gv-camera-0.8"
BROWSER = ("playwright", "chromium")
REMEDIES: Mapping[str, str] = {
    ARAVIS: "apt-get install aravis-tools",
    "chromium": "run tests/system/install-chromium.sh",
    "pypylon": install_command("pylon"),
    "torch": install_command("learn"),
    "onnx": install_command("learn"),
}
"""How to get what a bench needs; anything else comes with the extra `dev`."""
BENCHES: Mapping[str, Bench] = {
    "accept": Bench(module="accept.runs", whole_s=(900, 2400)),
    "archive": Bench(module="archive.figures", whole_s=(90, 180), needs=("moto",)),
    "attention": Bench(module="attention.maps", whole_s=(900, 1800)),
    "auth": Bench(module="access.figures", whole_s=(90, 180)),
    "batch": Bench(module="batch.figures", whole_s=(480, 720), needs=("distributed",)),
    "binning": Bench(module="verge.binning", whole_s=(180, 360)),
    "calibration": Bench(module="calibration.procedures", whole_s=(240, 480)),
    "capture": Bench(module="capture.captures", whole_s=(240, 480)),
    "clicks": Bench(module="verge.field_clicks", whole_s=(1800, 3600)),
    "console": Bench(module="console.figures", whole_s=(300, 480), needs=BROWSER, uses=("nbclient",)),
    "context": Bench(module="verge.look_around", whole_s=(120, 240)),
    "depth": Bench(module="depth.dense", whole_s=(240, 480), needs=("skimage",)),
    "doors": Bench(module="doors.stop", whole_s=(1080, 1500), needs=("schemathesis",)),
    "drivers": Bench(module="drivers.cameras", whole_s=(40, 120), needs=("pypylon", ARAVIS)),
    "faults": Bench(module="faults.all_kinds", whole_s=(240, 420), uses=(ARAVIS,)),
    "learned": Bench(
        module="learned.serving", whole_s=(300, 600), needs=("skimage",), uses=("torch", "onnx")
    ),
    "live": Bench(module="stream.live", whole_s=(110, 180), needs=BROWSER),
    "loop": Bench(module="loop.figures", whole_s=(360, 900)),
    "matching": Bench(module="depth.matching", whole_s=(60, 180), needs=("skimage",)),
    "measure": Bench(module="depth.measurements", whole_s=(120, 300)),
    "pace": Bench(module="pace.figures", whole_s=(1000, 1500), needs=BROWSER),
    "render": Bench(module="render.renderer", whole_s=(60, 120)),
    "replay": Bench(module="replay.long_recording", whole_s=(110, 240), needs=BROWSER),
    "scatter": Bench(module="verge.scattering_mirrors", whole_s=(300, 900)),
    "serial": Bench(module="drivers.mirror_link", whole_s=(20, 60)),
    "soak": Bench(module="soak.figures", whole_s=(2300, 3000)),
    "stereo": Bench(module="depth.stereo", whole_s=(60, 120)),
    "stream": Bench(module="stream.streams", whole_s=(35, 60)),
    "track": Bench(module="track.following", whole_s=(600, 1200)),
    "traces": Bench(module="stream.traces", whole_s=(5, 20)),
    "truth": Bench(module="verge.truth", whole_s=(900, 2400)),
    "verge": Bench(module="verge.fixations", whole_s=(600, 1500)),
}
"""Durations of batch, console, doors, faults, live, pace, replay, soak and stream are those of earlier runs.
The others are estimates, for some from the processor time of quick runs."""


def bench_names() -> list[str]:
    """Return the names of all benches, sorted."""
    return sorted(BENCHES)


def run_bench(
    name: str,
    *,
    quick: bool,
    data: Path | None = None,
    pairs: Path | None = None,
    binning: int | None = None,
    seed: int | None = None,
) -> Figures:
    """Run one bench and return its figures; show on stderr how long it takes, and how far it is.

    `data`: folder of pictures, if any; `pairs`: folder of held-out pairs, if any; `binning`: of the
    simulated cameras, by default 2 in a quick run, else the bench's own choice; `seed`: of what is drawn by
    chance, by default the bench's own. Raise InvalidInput for an unknown name, and for an option that the
    bench does not have; NotConnected where something that it needs is not installed.
    """
    if name not in BENCHES:
        raise InvalidInput(f"there is no bench called {name}; the benches are {', '.join(bench_names())}")
    bench = BENCHES[name]
    if missing := _missing(bench.needs):
        raise NotConnected(
            f"bench {name} needs {' and '.join(missing)}, not installed here",
            remedy="; ".join(dict.fromkeys(REMEDIES.get(one, install_command("dev")) for one in missing)),
        )
    run = import_module(f"foveacam_bench.{bench.module}").run
    accepted = inspect.signature(run).parameters
    if data is not None and "data" not in accepted:
        raise InvalidInput(f"bench {name} reads no pictures; leave --data out")
    if pairs is not None and "pairs" not in accepted:
        raise InvalidInput(f"bench {name} reads no pairs with truth; leave --pairs out")
    if binning is not None and "binning" not in accepted:
        raise InvalidInput(f"bench {name} chooses the binning itself; leave --binning out")
    if seed is not None and "seed" not in accepted:
        raise InvalidInput(f"bench {name} draws nothing by a seed; leave --seed out")
    options: dict[str, object] = {"quick": quick, "data": data, "pairs": pairs, "keep": show_part}
    used = binning or (QUICK_BINNING if quick else None)
    if used is not None:
        options["binning"] = used
    if seed is not None:
        options["seed"] = seed
    lacking = [f"without {one} some figures are null" for one in _missing(bench.uses)]
    limits_s = (0, QUICK_S) if quick else bench.whole_s
    with shown_progress(name, limits_s=limits_s, notes=lacking) as report:
        options["report"] = report
        return dict(run(**{option: value for option, value in options.items() if option in accepted}))


def _missing(names: tuple[str, ...]) -> list[str]:
    """Return which packages and programs are not installed; only a program's name has a dot."""
    return [name for name in names if not shutil.which(name) and ("." in name or find_spec(name) is None)]


def list_table() -> Table:
    """Return the names of all benches with what a whole run takes and needs."""
    table = Table(title="foveacam bench NAME [--json] [--quick]", caption=f"--quick: meant for {QUICK_S} s")
    table.add_column("name")
    table.add_column("takes", justify="right")
    table.add_column("needs")
    for name, bench in sorted(BENCHES.items()):
        table.add_row(name, duration_text(bench.whole_s), ", ".join((*bench.needs, *bench.uses)))
    return table


def bench_table(name: str, figures: Mapping[str, object]) -> Table:
    """Return the figures as a table."""
    table = Table(title=f"foveacam bench {name}")
    table.add_column("figure")
    table.add_column("value", justify="right")
    for key, value in figures.items():
        table.add_row(key, _shown(value))
    return table


def _shown(value: object) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:.4g}" if isinstance(value, float) else str(value)
