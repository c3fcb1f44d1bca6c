"""The formats in which a recording is exported: films by codec, pictures in a zip, numbers as NPY."""

from dataclasses import dataclass, field
from enum import StrEnum

from foveacam_hardware.contract import InvalidInput, install_command


class MovieCodec(StrEnum):
    """The codecs of a film, by the four letters that files name them with.

    H.264, VP9 and AV1 play in every browser, MPEG-4 in most players; ProRes is for editing.
    """

    H264 = "avc1"
    HEVC = "hvc1"
    VP9 = "vp09"
    AV1 = "av01"
    MPEG4 = "mp4v"
    PRORES_422 = "apcn"
    PRORES_HQ = "apch"
    PRORES_4444 = "ap4h"


@dataclass(frozen=True, slots=True, kw_only=True)
class Encoder:
    """FFmpeg's encoder of a codec, with options for speed at a quality that shows no blocks."""

    name: str
    options: dict[str, str] = field(default_factory=dict)
    pixel_format: str = "yuv420p"
    tag: str | None = None
    """The codec tag in the file, where players do not expect FFmpeg's default."""


def _prores(profile: int, pixel_format: str) -> Encoder:
    return Encoder(name="prores_ks", options={"profile": str(profile)}, pixel_format=pixel_format)


ENCODERS = {
    MovieCodec.H264: Encoder(name="libx264", options={"preset": "veryfast", "crf": "18"}),
    MovieCodec.HEVC: Encoder(
        name="libx265",
        options={"preset": "veryfast", "crf": "20", "x265-params": "log-level=error"},
        tag="hvc1",
    ),
    MovieCodec.VP9: Encoder(
        name="libvpx-vp9",
        options={"deadline": "realtime", "cpu-used": "8", "row-mt": "1", "crf": "24", "b": "0"},
    ),
    MovieCodec.AV1: Encoder(name="libsvtav1", options={"preset": "10", "crf": "26"}),
    MovieCodec.MPEG4: Encoder(name="mpeg4", options={"qmin": "2", "qmax": "4"}),
    MovieCodec.PRORES_422: _prores(2, "yuv422p10le"),
    MovieCodec.PRORES_HQ: _prores(3, "yuv422p10le"),
    MovieCodec.PRORES_4444: _prores(4, "yuv444p10le"),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class ExportFormat:
    """One format. `codec`: None for what is no film."""

    name: str
    title: str
    suffix: str
    media_type: str
    codec: MovieCodec | None = None

    @property
    def encoder(self) -> Encoder | None:
        """The encoder that it needs."""
        return None if self.codec is None else ENCODERS[self.codec]

    @property
    def missing(self) -> str:
        """Why this machine cannot write it; empty when it can."""
        return "" if self.encoder is None else missing_encoder(self.encoder.name)


def _film(name: str, title: str, codec: MovieCodec) -> ExportFormat:
    if title.startswith("ProRes"):
        return ExportFormat(name=name, title=title, suffix=".mov", media_type="video/quicktime", codec=codec)
    return ExportFormat(name=name, title=title, suffix=".mp4", media_type="video/mp4", codec=codec)


FORMATS = {
    found.name: found
    for found in (
        _film("h264", "H.264", MovieCodec.H264),
        _film("hevc", "H.265 (HEVC)", MovieCodec.HEVC),
        _film("vp9", "VP9", MovieCodec.VP9),
        _film("av1", "AV1", MovieCodec.AV1),
        _film("prores", "ProRes 422", MovieCodec.PRORES_422),
        _film("prores_hq", "ProRes 422 HQ", MovieCodec.PRORES_HQ),
        _film("prores_4444", "ProRes 4444", MovieCodec.PRORES_4444),
        _film("mpeg4", "MPEG-4", MovieCodec.MPEG4),
        ExportFormat(name="png", title="PNG pictures (ZIP)", suffix=".zip", media_type="application/zip"),
        ExportFormat(name="npy", title="NumPy array", suffix=".npy", media_type="application/octet-stream"),
    )
}


def missing_encoder(name: str) -> str:
    """Return why FFmpeg, as it is installed here, cannot encode; empty where it can."""
    try:
        import av  # installed by the extra `films`
    except ImportError:
        return f"films need PyAV, which is not installed: {install_command('films')}"
    try:
        av.codec.Codec(name, "w")
    except av.codec.codec.UnknownCodecError:
        return f"FFmpeg has no encoder {name} on this machine"
    return ""


def format_named(name: str) -> ExportFormat:
    """Return a format by its name or its codec's four letters; raise `InvalidInput` for another."""
    for found in FORMATS.values():
        if name in (found.name, found.codec):
            return found
    raise InvalidInput(
        f"export: there is no codec {name!r} here; choose {', '.join(FORMATS)} or leave it out"
    )


def check_format(wanted: ExportFormat) -> None:
    """Raise `InvalidInput` for a format that this machine cannot write, with those that it can."""
    if wanted.missing:
        written = ", ".join(found.title for found in FORMATS.values() if not found.missing)
        raise InvalidInput(
            f"export: {wanted.title} cannot be written, as {wanted.missing}",
            asked=wanted.title,
            found=wanted.missing,
            remedy=f"choose another: {written}",
        )
