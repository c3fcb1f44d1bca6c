"""The command `foveacam study standoff|depth|localisation|tradeoff|tokens|fig8|learned|all`."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from foveacam_server.commands.options import ClusterOption


class StudyName(StrEnum):
    """The names that the command takes."""

    DEPTH = "depth"
    LOCALISATION = "localisation"
    TRADEOFF = "tradeoff"
    TOKENS = "tokens"
    STANDOFF = "standoff"
    FIG8 = "fig8"
    LEARNED = "learned"
    ALL = "all"


def study(
    name: Annotated[StudyName, typer.Argument(help="which analysis of the paper, or all of Section 4")],
    as_json: Annotated[bool, typer.Option("--json", help="print one JSON object and nothing else")] = False,
    quick: Annotated[bool, typer.Option("--quick", help="fewer maps, scenes and positions")] = False,
    out: Annotated[
        Path | None,
        typer.Option(help="folder for report and pictures; usually foveacam-study, none with --json"),
    ] = None,
    jobs: Annotated[
        int | None,
        typer.Option(
            help="processes for random maps, usually 1, and trainings, usually one a core; -1: one a core",
            min=-1,
        ),
    ] = None,
    cluster: ClusterOption = None,
    maps: Annotated[
        int | None, typer.Option(help="random maps for Figs. 9 and 10; usually 10", min=1)
    ] = None,
    seed: Annotated[int | None, typer.Option(help="seed of all that is drawn at random", min=0)] = None,
    vkitti: Annotated[Path | None, typer.Option(help="folder of Virtual KITTI 2, for the trade-off")] = None,
    matching_error: Annotated[
        list[str] | None,
        typer.Option(
            metavar="PX|FILE",
            help="matching error for the study depth: in px, or as `foveacam bench stereo|verge|render "
            "--json` wrote it; may be repeated",
        ),
    ] = None,
    fresh: Annotated[bool, typer.Option("--fresh", help="compute again what is cached")] = False,
) -> None:
    """Reproduce the analyses of the paper and write a report; Ctrl-C keeps what is finished."""
    from foveacam_pipeline.diagrams import check_figures

    check_figures("a study")
    from foveacam_server.resources.studying.studies.recipes import StudyOrder, recipes
    from foveacam_server.resources.studying.studies.run import ReportOptions, run_studies

    left_out = (StudyName.ALL, StudyName.LEARNED)
    every = [each.value for each in StudyName if each not in left_out]
    names = every if name is StudyName.ALL else [name.value]
    order = StudyOrder(
        quick=quick,
        jobs=jobs,
        cluster=cluster,
        maps=maps,
        seed=seed,
        vkitti=vkitti,
        matching_errors=tuple(matching_error or ()),
    )
    wanted = ReportOptions(as_json=as_json, out=out, fresh=fresh, every=name is StudyName.ALL)
    run_studies(recipes(order, names), wanted)
