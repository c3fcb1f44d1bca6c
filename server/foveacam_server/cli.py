"""The `foveacam` program: serve, look, capture, calibrate, study and more.

Errors are one line; no traceback reaches a user. The groups of its help: `commands/program_help.py`.
"""

import json
import logging
import sys
from pathlib import Path
from typing import Annotated, NoReturn

import typer
from rich.console import Console

from foveacam_hardware.contract import FoveaError, InvalidInput
from foveacam_server import __version__
from foveacam_server.commands.backup import backup, restore
from foveacam_server.commands.calibrate import app as calibrate_app
from foveacam_server.commands.program_help import PanelledGroup, usage_error_text
from foveacam_server.commands.retention import app as retention_app
from foveacam_server.commands.users import app as users_app
from foveacam_server.foundation.errors import translate_error
from foveacam_server.foundation.gc_pause import gc_paused
from foveacam_server.foundation.settings import checked_settings, given_token
from foveacam_server.foundation.watching.log_lines import choose_format, configure_logging
from foveacam_server.resources.calibrating.acceptances.cli import accept
from foveacam_server.resources.capturing.archive.cli import app as archive_app
from foveacam_server.resources.capturing.batches.cli import app as batch_app
from foveacam_server.resources.capturing.captures.cli import capture
from foveacam_server.resources.capturing.captures.dataset_cli import app as dataset_app
from foveacam_server.resources.capturing.recordings.cli import app as recording_app
from foveacam_server.resources.capturing.recordings.cli import record
from foveacam_server.resources.capturing.stills.cli import still
from foveacam_server.resources.devices.displays.cli import app as board_app
from foveacam_server.resources.devices.positioners.cli import confirm_zero
from foveacam_server.resources.looking.depth_backends.cli import app as depth_app
from foveacam_server.resources.looking.fixations.cli import look
from foveacam_server.resources.studying.learning.cli import app as learn_app
from foveacam_server.resources.studying.studies.cli import study

app = typer.Typer(
    name="foveacam",
    cls=PanelledGroup,
    help="Foveated stereo in a browser: click a point, both foveae verge on it, its depth and shape appear.",
    no_args_is_help=True,
    context_settings={"help_option_names": ["--help", "-h"]},
    pretty_exceptions_enable=False,
)

app.add_typer(calibrate_app)
app.add_typer(board_app)
app.add_typer(depth_app)
app.add_typer(learn_app)
app.add_typer(dataset_app)
app.add_typer(batch_app)
app.add_typer(recording_app)
app.add_typer(archive_app)
app.command()(accept)
app.command()(record)
app.command()(capture)
app.command()(still)
app.command()(study)
app.command()(look)
app.command()(confirm_zero)
app.command()(backup)
app.command()(restore)
app.add_typer(retention_app)
app.add_typer(users_app)

_USAGE_ERROR = 2
_FAILURE = 1
_INTERRUPTED = 130

RigOption = Annotated[str | None, typer.Option(help="'sim', or the path of a rig file (.toml)")]
SceneOption = Annotated[
    str | None, typer.Option(help="scene of the simulated rig: a name that ships, or a scene file")
]
PresetOption = Annotated[str | None, typer.Option(help="mirrors of the simulated rig: rig120 or paper")]
HostOption = Annotated[
    str | None, typer.Option(help="address to listen on; beyond this machine, people must sign in")
]
CertificateOption = Annotated[
    Path | None, typer.Option(help="certificate with its chain (PEM), to serve https; with --tls-key")
]
KeyOption = Annotated[Path | None, typer.Option(help="private key of the certificate (PEM)")]
InsecureOption = Annotated[
    bool | None,
    typer.Option("--insecure", help="allow everything to everybody who reaches the server, without sign-in"),
]
PortOption = Annotated[int | None, typer.Option(help="port to listen on; 0 takes a free one", max=65535)]
TokenOption = Annotated[
    str | None,
    typer.Option(help="auto generates the token of clients; to choose one: --token-file, FOVEACAM_TOKEN"),
]
TokenFileOption = Annotated[Path | None, typer.Option(help="file with the token that clients must send")]
ProxyOption = Annotated[
    list[str] | None,
    typer.Option(
        help="address or network of a proxy whose X-Forwarded-For and -Proto are trusted; may be repeated"
    ),
]
RigsOption = Annotated[Path | None, typer.Option(help="file (.toml) that names other rigs of the lab")]
AnnounceOption = Annotated[
    bool | None,
    typer.Option("--announce", help="announce this rig in the local network, and list announced rigs"),
]
RootPathOption = Annotated[
    str | None, typer.Option(help="path below which a proxy serves this server, such as /foveacam")
]
DataOption = Annotated[Path | None, typer.Option(help="folder for targets, clouds, jobs and events")]
ArchiveOption = Annotated[
    str | None,
    typer.Option(
        help="where captures, recordings and stills are archived, s3://bucket/prefix", metavar="URL"
    ),
]
CalibrationOption = Annotated[
    Path | None, typer.Option(help="calibration file to use instead of the rig's own")
]
ReplayOption = Annotated[Path | None, typer.Option(help="recording (.fcap) to play instead of opening a rig")]
ReplaySpeedOption = Annotated[
    float | None, typer.Option(help="of the recorded speed, 0.25 to 4", min=0.25, max=4.0)
]
BinningOption = Annotated[
    str | None, typer.Option(help="of looks and live views: 1, 2, or rig, as the rig has it (the default)")
]
ReplayAtEndOption = Annotated[str | None, typer.Option(help="what follows the recording's end: loop or stop")]
LogFormatOption = Annotated[
    str | None, typer.Option(help="of the log on stderr: text, or json for one object a line")
]
OtlpOption = Annotated[
    str | None,
    typer.Option(
        metavar="URL", help="collector of traces (OTLP over HTTP)", envvar="OTEL_EXPORTER_OTLP_ENDPOINT"
    ),
]
JsonOption = Annotated[bool, typer.Option("--json", help="print one JSON object and nothing else")]


@app.command()
def serve(
    rig: RigOption = None,
    scene: SceneOption = None,
    preset: PresetOption = None,
    host: HostOption = None,
    port: PortOption = None,
    token: TokenOption = None,
    token_file: TokenFileOption = None,
    insecure: InsecureOption = None,
    tls_cert: CertificateOption = None,
    tls_key: KeyOption = None,
    trusted_proxy: ProxyOption = None,
    root_path: RootPathOption = None,
    rigs: RigsOption = None,
    announce: AnnounceOption = None,
    data: DataOption = None,
    archive: ArchiveOption = None,
    calibration: CalibrationOption = None,
    binning: BinningOption = None,
    replay: ReplayOption = None,
    replay_speed: ReplaySpeedOption = None,
    replay_at_end: ReplayAtEndOption = None,
    log_format: LogFormatOption = None,
    otlp_endpoint: OtlpOption = None,
) -> None:
    """Open the rig and serve the console, the 3D pane and the REST interface."""
    chosen = {
        "rig": rig,
        "scene": scene,
        "preset": preset,
        "host": host,
        "port": port,
        "token": given_token(token, token_file),
        "insecure": insecure,
        "tls_cert": tls_cert,
        "tls_key": tls_key,
        "trusted_proxies": trusted_proxy or None,
        "root_path": root_path,
        "rigs": rigs,
        "announce": announce,
        "data": data,
        "archive": archive,
        "calibration": calibration,
        "binning": binning,
        "replay": replay,
        "replay_speed": replay_speed,
        "replay_at_end": replay_at_end,
        "log_format": log_format,
        "otlp_endpoint": otlp_endpoint,
    }
    settings = checked_settings(chosen)
    choose_format(settings.log_format)  # before anything is loaded that logs
    from foveacam_server.doors.start_door import StartDoor  # not loaded for other commands
    from foveacam_server.rig.hardware_thread.early_kernels import kernels_of

    with StartDoor(settings) as door, kernels_of(settings) as kernels:  # both work while the rest is loaded
        with gc_paused():
            from foveacam_server.serving import run_server

        run_server(settings, console=Console(), door=door, kernels=kernels)


@app.command()
def bench(
    name: Annotated[str | None, typer.Argument(help="which figures; lists them without a name")] = None,
    as_json: JsonOption = False,
    quick: Annotated[bool, typer.Option("--quick", help="the same figures of less, in 90 s")] = False,
    data: Annotated[
        Path | None,
        typer.Option("--data", help="folder of real pairs (aloe/, tsukuba/), where a bench has them"),
    ] = None,
    pairs: Annotated[
        Path | None,
        typer.Option("--pairs", help="folder of held-out pairs with truth, where a bench takes them"),
    ] = None,
    binning: Annotated[
        int | None,
        typer.Option(
            "--binning",
            help="of the simulated cameras: calibration, clicks, context, depth, loop, track, verge",
            min=1,
            max=2,
        ),
    ] = None,
    seed: Annotated[
        int | None, typer.Option("--seed", help="of the clicks, in place of the usual ones: clicks", min=0)
    ] = None,
) -> None:
    """Measure and print the project's figures; needs a checkout of the sources."""
    from foveacam_pipeline.capture.mosaic.folder import finite
    from foveacam_server.foundation.bench_package import bench_module

    catalogue = bench_module("catalogue")
    if name is None:
        Console().print(catalogue.list_table())
        return
    figures = catalogue.run_bench(name, quick=quick, data=data, pairs=pairs, binning=binning, seed=seed)
    if as_json:
        typer.echo(json.dumps(finite(figures), allow_nan=False))
    else:
        Console().print(catalogue.bench_table(name, figures))


@app.command()
def doctor(
    rig: RigOption = None,
    scene: SceneOption = None,
    port: PortOption = None,
    data: DataOption = None,
    calibration: CalibrationOption = None,
    as_json: JsonOption = False,
    trigger_test: Annotated[
        bool, typer.Option("--trigger-test", help="also expose both foveae by one pulse, mirrors parked")
    ] = False,
    server: Annotated[
        str | None,
        typer.Option(metavar="URL", help="check a server that runs instead; FOVEACAM_TOKEN is sent to it"),
    ] = None,
) -> None:
    """Check the requirements of rig and server on this machine, or a running server; print remedies."""
    from foveacam_server.checks.findings import findings_document, findings_table, healthy
    from foveacam_server.doctor.examination import examine

    chosen = {"rig": rig, "scene": scene, "port": port, "data": data, "calibration": calibration}
    settings = checked_settings(chosen)
    if server is not None:
        from foveacam_server.doctor.running_server import examine_server

        findings = examine_server(server, token=settings.token)
    else:
        findings = examine(settings, trigger_test=trigger_test)
    if as_json:
        typer.echo(json.dumps(findings_document(findings).model_dump(mode="json")))
    else:
        Console().print(findings_table(findings))
    if not healthy(findings):
        raise typer.Exit(_FAILURE)


@app.command()
def version() -> None:
    """Print the version."""
    typer.echo(__version__)


def _print_version(wanted: bool) -> None:
    if wanted:
        version()
        raise typer.Exit


@app.callback()
def program(
    _version: Annotated[
        bool,
        typer.Option(
            "--version", "-V", help="print the version and exit", is_eager=True, callback=_print_version
        ),
    ] = False,
) -> None:
    """Take the options that stand before a command."""


def main() -> None:
    """Run the program; every error ends as one line and an exit status."""
    configure_logging()
    try:
        sys.exit(app(standalone_mode=False, prog_name="foveacam") or 0)
    except typer.TyperException as error:
        _fail_usage(error)
    except typer.Abort:
        _fail("it asked a question, and its input ended; run it in a terminal", _FAILURE)
    except FoveaError as error:
        _fail(str(error), _USAGE_ERROR if isinstance(error, InvalidInput) else _FAILURE)
    except KeyboardInterrupt:
        sys.exit(_INTERRUPTED)
    except Exception as error:
        logging.getLogger(__name__).debug("unforeseen", exc_info=error)
        if (known := translate_error(error)) is not None:
            _fail(str(known), _USAGE_ERROR if isinstance(known, InvalidInput) else _FAILURE)
        _fail(
            f"an unexpected error ({type(error).__name__}: {error}); "
            "run again with FOVEACAM_LOG=debug and report what it prints",
            _FAILURE,
        )


def _fail_usage(error: typer.TyperException) -> NoReturn:
    if not error.format_message():  # the help was printed in place of a missing command
        sys.exit(error.exit_code)
    _fail(usage_error_text(error), error.exit_code)


def _fail(message: str, status: int) -> NoReturn:
    line = " ".join(message.split())
    Console(stderr=True, soft_wrap=True).print(f"[red]foveacam:[/red] {_plain(line)}", highlight=False)
    sys.exit(status)


def _plain(text: str) -> str:
    return text.replace("[", "\\[")
