"""Token cost (Sec. 4.3, Eq. 5): the number of tokens of an image, and the cost of attention among them.

The times that a machine takes are a `TokenTimes`, measured by `learn.attention` and passed in.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from foveacam_hardware.contract import InvalidInput

BACKDROP_SHARE = 0.75
"""Share of all tokens in the backdrop; the streams have the rest: 25 %, as in Sec. 4.2."""
STREAMS = (1, 2, 4, 8)


def token_count(width_px: int, height_px: int, *, patch_px: int) -> int:
    """Return N = H W / P² (Sec. 4.3). Raise InvalidInput where the patches do not fill the image."""
    if width_px < 1 or height_px < 1 or patch_px < 1:
        raise InvalidInput(
            f"an image of {width_px} x {height_px} px in patches of {patch_px} px was given; "
            "all must exceed 0"
        )
    if width_px % patch_px or height_px % patch_px:
        raise InvalidInput(
            f"an image of {width_px} x {height_px} px does not divide into patches of {patch_px} px; "
            f"pad it to {_padded(width_px, patch_px)} x {_padded(height_px, patch_px)} px"
        )
    return (width_px // patch_px) * (height_px // patch_px)


def _padded(size_px: int, patch_px: int) -> int:
    return math.ceil(size_px / patch_px) * patch_px


def attention_cost(tokens: Sequence[int]) -> int:
    """Return how many pairs of tokens attend to each other: the sum of N² over streams (Eq. 5)."""
    if not tokens or min(tokens) < 1:
        raise InvalidInput(f"streams of {list(tokens)} tokens were given; every stream needs at least 1")
    return sum(count * count for count in tokens)


def split_tokens(
    total: int, *, streams: int, backdrop_share: float = BACKDROP_SHARE
) -> tuple[int, tuple[int, ...]]:
    """Return (tokens of the backdrop, tokens of each stream), together `total` exactly.

    Streams differ by one token at most. Raise InvalidInput where one of them would have none.
    """
    if streams < 1:
        raise InvalidInput(f"{streams} foveal streams were asked for; at least 1 is needed")
    if not 0.0 < backdrop_share < 1.0:
        raise InvalidInput(f"a backdrop share of {backdrop_share} was given; choose one between 0 and 1")
    backdrop = round(total * backdrop_share)
    each, more = divmod(total - backdrop, streams)
    if backdrop < 1 or each < 1:
        raise InvalidInput(
            f"{total} tokens cannot fill a backdrop and {streams} streams; give more tokens or fewer streams"
        )
    return backdrop, tuple(each + (index < more) for index in range(streams))


def cost_ratio(total: int, *, streams: int, backdrop_share: float = BACKDROP_SHARE) -> float:
    """Return C_FOV / C_MR at equal tokens: (N_low² + sum of N_i²) / N_total² (Eq. 5), always below 1."""
    backdrop, foveal = split_tokens(total, streams=streams, backdrop_share=backdrop_share)
    return attention_cost((backdrop, *foveal)) / attention_cost((total,))


@dataclass(frozen=True, slots=True, kw_only=True)
class SplitTime:
    """Time of backdrop and streams over the time of all tokens at once: of attention, and of a layer."""

    streams: int
    attention_ratio: float
    layer_ratio: float


@dataclass(frozen=True, slots=True, kw_only=True)
class TokenTimes:
    """Measured: processor seconds of one thread, (n,) each, for `tokens` of a layer `width` wide.

    `layer_s`: a whole transformer layer, with its projections and its two-layer perceptron. `splits` are of
    `split_total` tokens. `device` says what was timed, in words.
    """

    tokens: tuple[int, ...]
    attention_s: tuple[float, ...]
    layer_s: tuple[float, ...]
    split_total: int
    splits: tuple[SplitTime, ...]
    width: int
    heads: int
    device: str

    def __post_init__(self) -> None:
        """Refuse times from which no exponent can be fitted."""
        lengths = {len(self.tokens), len(self.attention_s), len(self.layer_s)}
        if lengths != {len(self.tokens)} or len(set(self.tokens)) < 2:
            raise InvalidInput(
                f"times of {len(self.attention_s)} and {len(self.layer_s)} token counts were given for "
                f"{len(self.tokens)}; at least two different counts are needed, and a time for each"
            )
        if min(self.attention_s) <= 0.0 or min(self.layer_s) <= 0.0:
            raise InvalidInput("a time of 0 s or less was given; measure again with more tokens")


def exponent(tokens: Sequence[int], seconds: Sequence[float]) -> float:
    """Return the slope of log time over log tokens, by least squares: 2 for C(N) ~ N² (Sec. 4.3)."""
    slope, _ = np.polyfit(np.log(np.asarray(tokens, dtype=np.float64)), np.log(seconds), 1)
    return float(slope)


def eq5_error(times: TokenTimes, *, least_streams: int = 2) -> float:
    """Return the largest relative error of Eq. 5 against measured attention, for `least_streams` or more."""
    errors = [
        abs(split.attention_ratio / cost_ratio(times.split_total, streams=split.streams) - 1.0)
        for split in times.splits
        if split.streams >= least_streams
    ]
    if not errors:
        raise InvalidInput(f"no split of {least_streams} streams or more was measured; measure one")
    return max(errors)
