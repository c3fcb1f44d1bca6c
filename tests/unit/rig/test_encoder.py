import asyncio
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor

import cv2
import numpy as np
import pytest

from foveacam_hardware.contract import VirtualClock
from foveacam_server.rig.encoder import EncodedPicture, JpegStore, Scale, eight_bit, encode_jpeg, halve
from foveacam_server.rig.frame_hub import FrameHub
from foveacam_server.rig.stream_messages import HEADER, frame


@pytest.fixture
def executor() -> Iterator[ThreadPoolExecutor]:
    with ThreadPoolExecutor(2) as pool:
        yield pool


def test_red_stays_red() -> None:
    picture = np.zeros((32, 48, 3), dtype=np.uint8)
    picture[..., 0] = 200
    decoded = cv2.imdecode(np.frombuffer(encode_jpeg(picture), np.uint8), cv2.IMREAD_COLOR_RGB)
    assert decoded is not None
    red, green, blue = decoded.reshape(-1, 3).mean(axis=0)
    assert red == pytest.approx(200.0, abs=4.0)
    assert max(green, blue) < 10.0


def test_a_grey_picture_stays_grey_and_full_size() -> None:
    picture = np.full((30, 40), 90, dtype=np.uint8)
    decoded = cv2.imdecode(np.frombuffer(encode_jpeg(picture), np.uint8), cv2.IMREAD_UNCHANGED)
    assert decoded is not None
    assert decoded.shape == (30, 40)


def test_halving_takes_the_mean_of_each_block() -> None:
    picture = np.arange(8 * 12, dtype=np.uint8).reshape(8, 12)
    expected = picture.reshape(4, 2, 6, 2).mean(axis=(1, 3))
    np.testing.assert_allclose(halve(picture), expected, atol=0.51)  # rounded to integers


def test_halving_an_odd_picture_leaves_the_last_row_and_column_out() -> None:
    assert halve(np.zeros((9, 13, 3), dtype=np.uint8)).shape == (4, 6, 3)


def test_twelve_bits_become_the_upper_eight() -> None:
    picture = np.array([[0, 16, 4095, 2048]], dtype=np.uint16)
    assert eight_bit(picture, bits=12).tolist() == [[0, 1, 255, 128]]


def test_one_encode_serves_any_number_of_askers(executor: ThreadPoolExecutor) -> None:
    hub = FrameHub(clock=VirtualClock())
    hub.publish("wide", np.zeros((64, 64), dtype=np.uint8), t_ns=1)

    async def scenario() -> tuple[list[EncodedPicture | None], dict[tuple[str, int], int]]:
        store = JpegStore(hub, executor=executor)
        full = await asyncio.gather(*(store.newest("wide", 1) for _ in range(8)))
        again = await store.newest("wide", 1)
        await store.newest("wide", 2)
        return [*full, again], {(view, scale): n for (view, scale), n in store.encodes.items()}

    encoded, encodes = asyncio.run(scenario())
    assert all(one is encoded[0] for one in encoded)
    assert encodes == {("wide", 1): 1, ("wide", 2): 1}


@pytest.mark.parametrize(("scale", "found", "shape"), [(1, 2, (24, 32)), (2, 2, (24, 32)), (4, 4, (12, 16))])
def test_a_binned_picture_is_at_most_as_large_as_it_is(
    executor: ThreadPoolExecutor, scale: Scale, found: int, shape: tuple[int, int]
) -> None:
    hub = FrameHub(clock=VirtualClock())
    hub.publish("wide", np.zeros((24, 32), dtype=np.uint8), t_ns=1, binning=2)

    async def scenario() -> tuple[EncodedPicture | None, int]:
        store = JpegStore(hub, executor=executor)
        encoded = await store.newest("wide", scale)
        await asyncio.gather(store.newest("wide", 1), store.newest("wide", 2))
        return encoded, sum(store.encodes.values())

    encoded, encodes = asyncio.run(scenario())
    assert encoded is not None
    assert encoded.scale == found
    picture = cv2.imdecode(np.frombuffer(encoded.jpeg, np.uint8), cv2.IMREAD_UNCHANGED)
    assert picture is not None
    assert picture.shape == shape
    assert encodes == (1 if found == 2 else 2)  # scales 1 and 2 share one encoding
    header = HEADER.unpack_from(frame(encoded, hub))
    assert (header[1], header[6]) == (found, 2)  # scale and binning
    status = hub.status("wide")
    assert (status.width, status.height, status.picture_scale) == (64, 48, 2)


def test_a_quarter_is_the_mean_of_sixteen_pixels() -> None:
    rng = np.random.default_rng(4)
    blocks = rng.integers(40, 200, (9, 12))
    picture = np.kron(blocks, np.ones((4, 4), dtype=np.int64)).astype(np.uint8)
    picture[::2, ::2] += 8
    picture[1::2, 1::2] -= 8
    jpeg = encode_jpeg(picture, reduction=4, quality=100)
    decoded = cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_UNCHANGED)
    assert decoded is not None
    np.testing.assert_allclose(decoded, blocks, atol=2.0)  # of JPEG at its best quality


def test_a_new_picture_is_encoded_anew(executor: ThreadPoolExecutor) -> None:
    hub = FrameHub(clock=VirtualClock())

    async def scenario() -> tuple[int, list[int]]:
        store = JpegStore(hub, executor=executor)
        times_ns = []
        for t_ns in (1, 2):
            hub.publish("wide", np.full((16, 16), t_ns, dtype=np.uint8), t_ns=t_ns)
            encoded = await store.newest("wide", 1)
            assert encoded is not None
            times_ns.append(encoded.picture.t_ns)
        return store.encodes["wide", 1], times_ns

    assert asyncio.run(scenario()) == (2, [1, 2])


def test_nothing_is_encoded_while_nobody_asks(executor: ThreadPoolExecutor) -> None:
    hub = FrameHub(clock=VirtualClock())
    hub.publish("wide", np.zeros((16, 16), dtype=np.uint8), t_ns=1)
    assert JpegStore(hub, executor=executor).encodes == {}


def test_an_asker_that_leaves_does_not_cancel_the_others(executor: ThreadPoolExecutor) -> None:
    hub = FrameHub(clock=VirtualClock())
    hub.publish("wide", np.zeros((16, 16), dtype=np.uint8), t_ns=1)

    async def scenario() -> EncodedPicture | None:
        store = JpegStore(hub, executor=executor)
        leaver = asyncio.create_task(store.newest("wide", 1))
        await asyncio.sleep(0)
        stayer = asyncio.create_task(store.newest("wide", 1))
        await asyncio.sleep(0)
        leaver.cancel()
        return await stayer

    assert asyncio.run(scenario()) is not None


def test_a_view_without_pictures_has_no_jpeg(executor: ThreadPoolExecutor) -> None:
    hub = FrameHub(clock=VirtualClock())

    async def scenario() -> EncodedPicture | None:
        return await JpegStore(hub, executor=executor).newest("wide", 1)

    assert asyncio.run(scenario()) is None
