"""Measure the time of torch's attention on this machine (Sec. 4.3), alone and in a transformer layer.

torch is imported when something is timed, not before. Times are processor seconds of one thread, the least of
several runs: other load can lengthen a time but not shorten it.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib import import_module
from types import ModuleType
from typing import Any

from foveacam_hardware.contract import InvalidInput, install_command
from foveacam_pipeline.study.tokens.cost import STREAMS, SplitTime, TokenTimes, split_tokens
from foveacam_pipeline.workers.progress import SILENT, ProgressSteps, ProgressWatcher

Run = Callable[[int], None]
"""Runs once with the given number of tokens."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Timing:
    """Settings: each count of `tokens` is timed, and `split_total` tokens as a backdrop and streams.

    The layer is `heads` times `head_width` wide, its perceptron `expansion` times that: the published sizes
    of a small vision transformer.
    """

    tokens: tuple[int, ...] = (512, 1024, 2048, 4096)
    split_total: int = 4096
    streams: tuple[int, ...] = STREAMS
    heads: int = 6
    head_width: int = 64
    expansion: int = 4
    repeats: int = 3
    seed: int = 0

    def __post_init__(self) -> None:
        """Refuse settings that are not above 0."""
        if self.repeats < 1 or min(*self.tokens, self.heads, self.head_width, self.expansion) < 1:
            raise InvalidInput(
                f"{self.repeats} repeats of {self.tokens} tokens, {self.heads} heads of {self.head_width} "
                "were asked for; every number must exceed 0"
            )


FULL = Timing()
QUICK = Timing(tokens=(512, 1024, 2048), split_total=2048)


def measure(timing: Timing = FULL, *, watch: ProgressWatcher = SILENT) -> TokenTimes:
    """Return the measured times. Raise InvalidInput without torch, Cancelled when the watcher asks."""
    torch = _torch()
    from foveacam_pipeline.learn.device import one_thread

    steps = ProgressSteps(
        watch,
        2 * timing.repeats * (len(timing.tokens) + len(timing.streams) + 1),
        ended="timing of attention was cancelled; nothing was kept, start it again",
    )
    with one_thread(), torch.inference_mode():
        runs = (_attention(torch, timing), _layer(torch, timing))
        series = [_series(run, timing, steps) for run in runs]
        ratios = [_ratios(run, timing, steps) for run in runs]
    splits = tuple(
        SplitTime(streams=streams, attention_ratio=attention, layer_ratio=layer)
        for streams, attention, layer in zip(timing.streams, *ratios, strict=True)
    )
    return TokenTimes(
        tokens=timing.tokens,
        attention_s=series[0],
        layer_s=series[1],
        split_total=timing.split_total,
        splits=splits,
        width=timing.heads * timing.head_width,
        heads=timing.heads,
        device=f"torch {torch.__version__}, CPU, one thread, least of {timing.repeats}",
    )


def _series(run: Run, timing: Timing, steps: ProgressSteps) -> tuple[float, ...]:
    """Return the least time for each count of tokens."""
    return _least(run, [(count,) for count in timing.tokens], timing, steps)


def _ratios(run: Run, timing: Timing, steps: ProgressSteps) -> tuple[float, ...]:
    """Return the time of backdrop and streams over that of all tokens at once, for each count of streams."""
    cuts: list[tuple[int, ...]] = [(timing.split_total,)]
    for streams in timing.streams:
        backdrop, foveal = split_tokens(timing.split_total, streams=streams)
        cuts.append((backdrop, *foveal))
    whole_s, *split_s = _least(run, cuts, timing, steps)
    return tuple(each_s / whole_s for each_s in split_s)


def _least(
    run: Run, cuts: Sequence[tuple[int, ...]], timing: Timing, steps: ProgressSteps
) -> tuple[float, ...]:
    """Return the least processor time of each cut; cuts alternate, so that load affects all alike."""
    least_s = [float("inf")] * len(cuts)
    run(min(min(cut) for cut in cuts))  # the first call initialises what later ones reuse
    for _ in range(timing.repeats):
        for index, cut in enumerate(cuts):
            started_s = time.thread_time()
            for count in cut:
                run(count)
            least_s[index] = min(least_s[index], time.thread_time() - started_s)
            steps.step(f"attention among {sum(cut)} tokens in {len(cut)} parts")
    return tuple(least_s)


def _attention(torch: ModuleType, timing: Timing) -> Run:
    """Return scaled dot-product attention alone, with its queries, keys and values created beforehand."""
    source = torch.Generator().manual_seed(timing.seed)
    most = max(*timing.tokens, timing.split_total)
    made = torch.randn((3, 1, timing.heads, most, timing.head_width), generator=source)

    def run(count: int) -> None:
        query, key, value = (part[..., :count, :] for part in made)
        torch.nn.functional.scaled_dot_product_attention(query, key, value)

    return run


def _layer(torch: ModuleType, timing: Timing) -> Run:
    """Return a whole pre-normalised transformer layer: attention, its projections, and the perceptron."""
    nn, width = torch.nn, timing.heads * timing.head_width
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(timing.seed)
        before, after = nn.LayerNorm(width), nn.LayerNorm(width)
        project, merge = nn.Linear(width, 3 * width), nn.Linear(width, width)
        widen, narrow = nn.Linear(width, timing.expansion * width), nn.Linear(timing.expansion * width, width)
        made = torch.randn((1, max(*timing.tokens, timing.split_total), width))

    def heads_of(image: Any) -> Any:  # noqa: ANN401 - a tensor: torch may be missing
        return image.unflatten(-1, (timing.heads, timing.head_width)).transpose(1, 2)

    def run(count: int) -> None:
        x = made[:, :count]
        query, key, value = (heads_of(part) for part in project(before(x)).chunk(3, dim=-1))
        seen = nn.functional.scaled_dot_product_attention(query, key, value)
        x = x + merge(seen.transpose(1, 2).flatten(2))
        x = x + narrow(nn.functional.gelu(widen(after(x))))

    return run


def _torch() -> ModuleType:
    try:
        return import_module("torch")
    except ImportError as error:
        raise InvalidInput(
            f"timing attention needs torch, which is not installed; {install_command('learn')}"
        ) from error
