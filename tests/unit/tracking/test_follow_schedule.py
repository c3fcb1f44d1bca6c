"""Which target is looked at next."""

import numpy as np
import pytest

from foveacam_pipeline.track.look_schedule import Claim, LookSchedule


def simulate(
    strays: list[float], priorities: list[float], *, looks: int = 800, seed: int = 0
) -> list[list[int]]:
    """Return the ages at which each target was looked at, looks; a stray below 0 is drawn anew every time."""
    rng, schedule = np.random.default_rng(seed), LookSchedule()
    last = [0] * len(strays)
    ages: list[list[int]] = [[] for _ in strays]
    for look in range(1, looks + 1):
        claims = {
            f"{index}": Claim(priority=priority, stray=stray if stray >= 0.0 else rng.uniform(0, 3))
            for index, (stray, priority) in enumerate(zip(strays, priorities, strict=True))
        }
        chosen = int(schedule.choose(claims))
        ages[chosen].append(look - last[chosen])
        last[chosen] = look
    return ages


def test_equals_take_turns() -> None:
    ages = simulate([0.0] * 4, [1.0] * 4)
    assert {age for one in ages for age in one[1:]} == {4}


def test_a_target_that_may_have_strayed_is_looked_at_first() -> None:
    schedule = LookSchedule()
    claims = {"calm": Claim(), "strayed": Claim(stray=1.0), "still": Claim()}
    assert schedule.choose(claims) == "strayed"


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("count", [2, 3, 4, 8])
def test_nothing_starves_whatever_the_others_claim(seed: int, count: int) -> None:
    strays = [0.0, *[-1.0] * (count - 2), 50.0]
    ages = simulate(strays, [1.0] * count, seed=seed)
    assert max(age for one in ages for age in one) <= 1.5 * count
    assert min(len(one) for one in ages) >= 0.97 * 800 / count


@pytest.mark.parametrize("priorities", [[2.0, 1.0], [2.0, 1.0, 1.0], [4.0, 2.0, 1.0, 0.5]])
def test_looks_are_shared_by_priority(priorities: list[float]) -> None:
    counts = [len(one) for one in simulate([0.0] * len(priorities), priorities)]
    expected = [800 * priority / sum(priorities) for priority in priorities]
    assert counts == pytest.approx(expected, abs=2)


def test_one_that_comes_back_does_not_get_all_that_it_missed() -> None:
    schedule = LookSchedule()
    for _ in range(50):
        schedule.choose({"a": Claim()})
    chosen = [schedule.choose({"a": Claim(), "b": Claim()}) for _ in range(10)]
    assert abs(chosen.count("a") - chosen.count("b")) <= 2


def test_a_single_target_is_always_next_and_none_is_an_error() -> None:
    schedule = LookSchedule()
    assert {schedule.choose({"a": Claim()}) for _ in range(3)} == {"a"}
    with pytest.raises(ValueError, match="no claim"):
        schedule.choose({})
