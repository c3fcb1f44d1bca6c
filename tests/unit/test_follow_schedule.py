"""Which target is looked at next."""

import numpy as np
import pytest

from foveacam_pipeline.track.schedule import MOST_SHARES, Claim, next_claim

LOOK_S = 0.1


def simulate(
    strays: list[float], priorities: list[float], *, looks: int = 800, seed: int = 0
) -> list[list[float]]:
    """Return the ages at which each target was looked at, s; a stray below 0 is drawn anew at every look."""
    rng = np.random.default_rng(seed)
    last = [0.0] * len(strays)
    ages: list[list[float]] = [[] for _ in strays]
    for look in range(1, looks + 1):
        now_s = look * LOOK_S
        claims = [
            Claim(age_s=now_s - seen, stray=stray if stray >= 0.0 else rng.uniform(0, 3), priority=priority)
            for seen, stray, priority in zip(last, strays, priorities, strict=True)
        ]
        chosen = next_claim(claims, look_s=LOOK_S)
        ages[chosen].append(now_s - last[chosen])
        last[chosen] = now_s
    return ages


def test_equals_take_turns() -> None:
    ages = simulate([0.0] * 4, [1.0] * 4)
    assert {round(age, 6) for one in ages for age in one[1:]} == {0.4}


def test_a_target_that_may_have_strayed_is_looked_at_more_often() -> None:
    calm, strayed = simulate([0.0, 1.0, 0.0, 0.0], [1.0] * 4)[:2]
    assert len(strayed) > 1.1 * len(calm)


@pytest.mark.parametrize("seed", range(4))
def test_nothing_starves_whatever_the_others_claim(seed: int) -> None:
    ages = simulate([0.0, -1.0, -1.0, -1.0, -1.0, -1.0, -1.0, 50.0], [1.0] * 8, seed=seed)
    fair_s = 8 * LOOK_S
    assert max(age for one in ages for age in one) <= (MOST_SHARES + 1.0) * fair_s
    assert float(np.quantile([age for one in ages for age in one], 0.99)) <= 1.5 * fair_s


def test_looks_are_shared_by_priority() -> None:
    counts = [len(one) for one in simulate([0.0] * 3, [2.0, 1.0, 1.0])]
    assert counts[0] == pytest.approx(2 * counts[1], rel=0.1)
    assert counts[1] == pytest.approx(counts[2], rel=0.1)


def test_a_single_target_is_always_next_and_none_is_an_error() -> None:
    assert next_claim([Claim(age_s=0.0)], look_s=LOOK_S) == 0
    with pytest.raises(ValueError, match="no claim"):
        next_claim([], look_s=LOOK_S)
