"""Sec. 4.3: tokens, the cost of attention among them, and what backdrop and streams save (Eq. 5)."""

import math
import sys
from dataclasses import replace
from types import SimpleNamespace

import pytest

from foveacam_hardware.contract import Cancelled, InvalidInput
from foveacam_pipeline.learn import attention
from foveacam_pipeline.learn.attention import Timing, measure
from foveacam_pipeline.study.report.findings import StudyResult
from foveacam_pipeline.study.tokens.cost import (
    SplitTime,
    TokenTimes,
    attention_cost,
    cost_ratio,
    eq5_error,
    exponent,
    split_tokens,
    token_count,
)
from foveacam_pipeline.study.tokens.study import tokens_study

Shape = tuple[int, ...]
COUNTS = (512, 1024, 2048, 4096)
TIMES = TokenTimes(
    tokens=COUNTS,
    attention_s=tuple(3e-8 * count**2 for count in COUNTS),
    layer_s=tuple(3e-8 * count**2 + 5e-5 * count for count in COUNTS),
    split_total=4096,
    splits=(
        SplitTime(streams=1, attention_ratio=0.75, layer_ratio=0.8),
        SplitTime(streams=2, attention_ratio=0.6, layer_ratio=0.75),
        SplitTime(streams=4, attention_ratio=0.55, layer_ratio=0.7),
    ),
    width=384,
    heads=6,
    device="made up",
)


def test_an_image_makes_one_token_a_patch() -> None:
    assert token_count(518, 518, patch_px=14) == 37 * 37
    assert token_count(1440, 1080, patch_px=8) == 1440 * 1080 // 64
    with pytest.raises(InvalidInput, match=r"1242 x 375 px does not divide .* pad it to 1246 x 378 px"):
        token_count(1242, 375, patch_px=14)
    with pytest.raises(InvalidInput, match="all must exceed 0"):
        token_count(100, 100, patch_px=0)


@pytest.mark.parametrize(("streams", "ratio"), [(1, 0.625), (2, 0.59375), (4, 0.578125), (8, 0.5703125)])
def test_equation_5_at_equal_tokens(streams: int, ratio: float) -> None:
    assert cost_ratio(4096, streams=streams) == ratio


@pytest.mark.parametrize("total", [97, 1024, 4099])
@pytest.mark.parametrize("streams", [1, 3, 8])
def test_the_split_keeps_every_token_and_always_costs_less(total: int, streams: int) -> None:
    backdrop, foveal = split_tokens(total, streams=streams)
    assert backdrop + sum(foveal) == total
    assert max(foveal) - min(foveal) <= 1
    assert attention_cost((backdrop, *foveal)) < attention_cost((total,))


def test_splits_that_leave_a_stream_without_tokens_are_refused() -> None:
    with pytest.raises(InvalidInput, match="8 tokens cannot fill a backdrop and 4 streams"):
        split_tokens(8, streams=4)
    with pytest.raises(InvalidInput, match="0 foveal streams"):
        split_tokens(100, streams=0)
    with pytest.raises(InvalidInput, match=r"a backdrop share of 1\.0"):
        split_tokens(100, streams=2, backdrop_share=1.0)
    with pytest.raises(InvalidInput, match="needs at least 1"):
        attention_cost((10, 0))


def test_the_exponent_is_read_from_times() -> None:
    assert exponent(COUNTS, TIMES.attention_s) == pytest.approx(2.0)
    assert 1.0 < exponent(COUNTS, TIMES.layer_s) < 2.0
    with pytest.raises(InvalidInput, match="at least two different counts"):
        replace(TIMES, tokens=(512,), attention_s=(1.0,), layer_s=(1.0,))
    with pytest.raises(InvalidInput, match="a time of 0 s or less"):
        replace(TIMES, layer_s=(0.0, 1.0, 1.0, 1.0))


def test_the_law_is_judged_by_two_streams_and_more() -> None:
    assert eq5_error(TIMES) == pytest.approx(abs(0.55 / 0.578125 - 1.0))
    assert eq5_error(TIMES, least_streams=1) == pytest.approx(0.75 / 0.625 - 1.0)
    with pytest.raises(InvalidInput, match="no split of 16 streams"):
        eq5_error(TIMES, least_streams=16)


def test_the_study_tells_what_was_measured() -> None:
    study = tokens_study(measured=TIMES)
    assert study.values["attention_exponent"] == pytest.approx(2.0)
    assert study.values["eq5_max_rel_error"] == pytest.approx(eq5_error(TIMES))
    assert study.values["layer_saving"] == pytest.approx(0.3)
    assert [picture.figure for picture in study.pictures] == ["Fig. 5(b)", "Eq. 5"]
    assert StudyResult.from_document(study.document()) == study


def test_the_study_tells_the_model_alone_where_nothing_was_measured() -> None:
    study = tokens_study(quick=True, measured=None)
    assert study.values["attention_exponent"] is None
    assert study.values["eq5_ratio_by_streams"]["4"] == 0.578125  # type: ignore[index,call-overload]  # a dict
    missing = [row.ours for row in study.rows if row.ours.startswith("not measured: ")]
    assert len(missing) == 3
    assert all("pip install 'foveacam-duo[learn]'" in said for said in missing)
    assert len(study.pictures) == 1


def test_without_torch_a_sentence_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "torch", None)
    with pytest.raises(InvalidInput, match=r"needs torch.*foveacam-duo\[learn\]"):
        measure()


def test_nothing_that_cannot_be_timed_is_begun() -> None:
    with pytest.raises(InvalidInput, match="every number must exceed 0"):
        Timing(repeats=0)


class Impatient:
    """Wants no more after the first step."""

    def progress(self, done: int, *, total: int, note: str = "") -> None:
        assert done == 1 < total, note

    def cancelled(self) -> bool:
        return True


def test_attention_of_torch_follows_the_square_and_equation_5(monkeypatch: pytest.MonkeyPatch) -> None:
    torch = pytest.importorskip("torch", reason="the extra `learn` is not installed")
    from torch.utils.flop_counter import FlopCounterMode

    def count(query: Shape, key: Shape, *_given: object, **_named: object) -> int:
        """Return the operations of two products; shapes are (batch, heads, tokens, width)."""
        return 4 * math.prod(query) * key[2]

    on_cpu = torch.ops.aten._scaled_dot_product_flash_attention_for_cpu  # which the counter does not know
    counter = FlopCounterMode(display=False, custom_mapping={on_cpu: count})
    threads = torch.get_num_threads()
    # Operations in place of seconds: a time on a busy machine is nobody's
    clock = SimpleNamespace(thread_time=lambda: float(counter.get_total_flops()))
    monkeypatch.setattr(attention, "time", clock)
    with counter:
        found = measure(Timing(tokens=(512, 1024, 2048), split_total=2048, streams=(2, 4)))
    assert exponent(found.tokens, found.attention_s) == pytest.approx(2.0)
    assert eq5_error(found) == pytest.approx(0.0, abs=1e-9)
    assert all(split.attention_ratio < split.layer_ratio < 1.0 for split in found.splits)
    assert torch.get_num_threads() == threads


def test_timing_ends_when_it_is_cancelled() -> None:
    pytest.importorskip("torch", reason="the extra `learn` is not installed")
    with pytest.raises(Cancelled, match="timing of attention was cancelled"):
        measure(Timing(tokens=(16, 32), split_total=64, streams=(1,)), watch=Impatient())
