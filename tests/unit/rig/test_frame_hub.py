import asyncio
import threading

import numpy as np
import pytest
from numpy.typing import NDArray

from foveacam_hardware.contract import Frame, InvalidInput, Role, VirtualClock
from foveacam_server.rig.frame_hub import FrameHub
from foveacam_server.rig.schema import OverlayDocument
from foveacam_server.rig.view_state import FROZEN_AFTER_MS

MS = 1_000_000


def noise(seed: int, *, height: int = 48, width: int = 64) -> NDArray[np.uint8]:
    return np.random.default_rng(seed).integers(0, 256, (height, width), dtype=np.uint8)


def test_the_newest_picture_wins() -> None:
    hub = FrameHub(clock=VirtualClock(100 * MS))
    for seq in (1, 2, 3):
        hub.publish("wide", noise(seq), t_ns=seq * MS, seq=seq)
    newest = hub.newest("wide")
    assert newest is not None
    assert (newest.seq, newest.t_ns) == (3, 3 * MS)


def test_an_older_picture_never_replaces_a_newer_one() -> None:
    hub = FrameHub(clock=VirtualClock())
    hub.publish("wide", noise(1), t_ns=5 * MS, seq=5)
    hub.publish("wide", noise(2), t_ns=4 * MS, seq=4)
    newest = hub.newest("wide")
    assert newest is not None
    assert newest.seq == 5
    assert hub.status("wide").repeated == 1


def test_a_view_without_pictures_has_no_age_and_no_freeze() -> None:
    status = FrameHub(clock=VirtualClock(10_000 * MS)).status("left")
    assert (status.age_ms, status.frozen_since_ms, status.rate_hz) == (None, None, 0.0)


def test_rate_and_age_follow_the_clock() -> None:
    clock = VirtualClock(1_000 * MS)
    hub = FrameHub(clock=clock)
    for seq in range(20):
        hub.publish("wide", noise(seq), t_ns=clock.now_ns(), seq=seq)
        clock.sleep_until_ns(clock.now_ns() + 50 * MS)
    status = hub.status("wide")
    assert status.rate_hz == pytest.approx(20.0)
    assert status.age_ms == pytest.approx(50.0)


def test_the_rate_falls_to_zero_when_pictures_stop() -> None:
    clock = VirtualClock(1_000 * MS)
    hub = FrameHub(clock=clock)
    for seq in range(5):
        hub.publish("wide", noise(seq), t_ns=clock.now_ns(), seq=seq)
        clock.sleep_until_ns(clock.now_ns() + 50 * MS)
    clock.sleep_until_ns(clock.now_ns() + 3_000 * MS)
    assert hub.status("wide").rate_hz == 0.0


def test_a_live_view_that_gets_no_picture_is_frozen_since_its_last() -> None:
    clock = VirtualClock(1_000 * MS)
    hub = FrameHub(clock=clock)
    hub.publish("wide", noise(1), t_ns=clock.now_ns())
    clock.sleep_until_ns(clock.now_ns() + 4_000 * MS)
    assert hub.status("wide").frozen_since_ms == pytest.approx(4_000.0)


def test_a_live_view_whose_pictures_are_all_alike_is_frozen() -> None:
    clock = VirtualClock(1_000 * MS)
    hub = FrameHub(clock=clock)
    same = noise(1)
    for seq in range(1 + int(FROZEN_AFTER_MS / 100) + 1):
        hub.publish("left", same.copy(), t_ns=clock.now_ns(), seq=seq)
        clock.sleep_until_ns(clock.now_ns() + 100 * MS)
    assert hub.status("left").frozen_since_ms == pytest.approx(FROZEN_AFTER_MS + 200.0)


def test_a_fovea_that_nobody_watches_may_rest_but_not_while_watched() -> None:
    clock = VirtualClock(1_000 * MS)
    hub = FrameHub(clock=clock)
    hub.publish("left", noise(1), t_ns=clock.now_ns())
    clock.sleep_until_ns(clock.now_ns() + 60_000 * MS)
    assert hub.status("left").frozen_since_ms is None

    async def scenario() -> tuple[float | None, float | None]:
        hub.watch(frozenset({"left"}), lambda _view: None)
        at_once = hub.status("left").frozen_since_ms
        clock.sleep_until_ns(clock.now_ns() + 2_000 * MS)
        return at_once, hub.status("left").frozen_since_ms

    at_once_ms, later_ms = asyncio.run(scenario())
    assert at_once_ms is None
    assert later_ms == pytest.approx(62_000.0)


def test_a_black_picture_is_not_taken_for_a_frozen_one() -> None:
    clock = VirtualClock(1_000 * MS)
    hub = FrameHub(clock=clock)
    for seq in range(40):
        hub.publish("left", np.zeros((48, 64), dtype=np.uint8), t_ns=clock.now_ns(), seq=seq)
        clock.sleep_until_ns(clock.now_ns() + 100 * MS)
    assert hub.status("left").frozen_since_ms is None


def test_a_computed_view_may_stand_still() -> None:
    clock = VirtualClock(1_000 * MS)
    hub = FrameHub(clock=clock)
    hub.publish_picture("depth", np.zeros((4, 6, 3), dtype=np.uint8), t_ns=clock.now_ns())
    clock.sleep_until_ns(clock.now_ns() + 60_000 * MS)
    assert hub.status("depth").frozen_since_ms is None


def test_the_size_of_a_view_is_that_of_its_newest_picture() -> None:
    hub = FrameHub(clock=VirtualClock())
    hub.publish_picture("anaglyph", np.zeros((90, 120, 3), dtype=np.uint8), t_ns=1)
    status = hub.status("anaglyph")
    assert (status.width, status.height) == (120, 90)


def test_a_frame_goes_to_the_view_of_its_role() -> None:
    hub = FrameHub(clock=VirtualClock())
    image = np.full((4, 6), 4095, dtype=np.uint16)
    frame = Frame(image=image, role=Role.RIGHT, seq=9, t_ns=7, exposure_ns=1, bits=12)
    overlay = OverlayDocument()
    hub.publish_frame(frame, meta=overlay)
    newest = hub.newest("right")
    assert newest is not None
    assert (newest.seq, newest.bits, newest.meta) == (9, 12, overlay)


def test_an_unknown_view_is_refused_by_name() -> None:
    with pytest.raises(InvalidInput, match=r"'back'.*wide, left, right"):
        FrameHub(clock=VirtualClock()).newest("back")


def test_a_picture_of_floats_is_refused() -> None:
    hub = FrameHub(clock=VirtualClock())
    with pytest.raises(InvalidInput, match="float64"):
        hub.publish("wide", np.zeros((4, 4)), t_ns=1)  # type: ignore[arg-type]  # the mistake under test


def test_a_picture_published_by_another_thread_wakes_the_loop() -> None:
    hub = FrameHub(clock=VirtualClock())

    async def scenario() -> str:
        woken: asyncio.Queue[str] = asyncio.Queue()
        watch = hub.watch(frozenset({"left"}), woken.put_nowait)
        thread = threading.Thread(target=hub.publish, args=("left", noise(1)), kwargs={"t_ns": 1})
        thread.start()
        view = await asyncio.wait_for(woken.get(), timeout=5.0)
        thread.join()
        watch.close()
        return view

    assert asyncio.run(scenario()) == "left"


def test_many_pictures_while_the_loop_is_busy_wake_it_once() -> None:
    hub = FrameHub(clock=VirtualClock())

    async def scenario() -> list[str]:
        woken: list[str] = []
        hub.watch(frozenset({"wide", "left"}), woken.append)
        for seq in range(1, 50):
            hub.publish("wide", noise(seq), t_ns=seq, seq=seq)
        await asyncio.sleep(0)
        return woken

    assert asyncio.run(scenario()) == ["wide"]


def test_only_watched_views_are_watched() -> None:
    hub = FrameHub(clock=VirtualClock())

    async def scenario() -> tuple[bool, bool, bool]:
        watch = hub.watch(frozenset({"left"}), lambda _view: None)
        during = hub.watched("left"), hub.watched("wide")
        watch.close()
        return (*during, hub.watched("left"))

    assert asyncio.run(scenario()) == (True, False, False)


def test_a_loop_that_closed_without_farewell_is_forgotten() -> None:
    hub = FrameHub(clock=VirtualClock())

    async def scenario() -> None:
        hub.watch(frozenset({"wide"}), lambda _view: None)

    asyncio.run(scenario())
    hub.publish("wide", noise(1), t_ns=1)
    assert not hub.watched("wide")
