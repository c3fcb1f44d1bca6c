"""A session of the steering socket without a network: a lost client, another's lease, a stop."""

import asyncio
import json
from collections.abc import AsyncIterator, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest
from fastapi import WebSocketDisconnect
from tests.support.devices.hardware_setup import PATIENCE_S, POLL_S, HardwareSetup, hardware_setup

from foveacam_hardware.contract import PARKED, MirrorVolts, StereoVolts
from foveacam_server.foundation.lease import Lease, LeaseClaim
from foveacam_server.resources.devices.mirrors.steering import SteeringServices, SteeringSession
from foveacam_server.rig import hand_steering

BEGIN = '{"type":"begin","name":"Ada"}'
RELEASE = '{"type":"steer","held":false}'
THERE = StereoVolts(left=MirrorVolts(x_v=30.0, y_v=-12.0), right=PARKED.right)
ASIDE = StereoVolts(left=MirrorVolts(x_v=-20.0, y_v=0.0), right=PARKED.right)


def steer(volts: StereoVolts) -> str:
    left = {"x_v": volts.left.x_v, "y_v": volts.left.y_v}
    return json.dumps({"type": "steer", "held": True, "volts": {"left": left}})


class Client:
    """Sends messages and is then disconnected; keeps the state that it was sent last."""

    def __init__(self) -> None:
        self.messages: AsyncIterator[str]
        self.status = ""

    async def receive_text(self) -> str:
        await asyncio.sleep(POLL_S)
        try:
            return await anext(self.messages)
        except StopAsyncIteration:
            raise WebSocketDisconnect from None

    async def send_text(self, data: str) -> None:
        self.status = json.loads(data).get("status", self.status)


class Bench:
    """A session on a fake rig, whose client does what a test says."""

    def __init__(self, setup: HardwareSetup) -> None:
        self.setup = setup
        self.hardware = setup.start()
        self.mirrors = setup.rig.mirrors
        self.lease = Lease(clock=setup.clock, events=setup.events)
        self.client = Client()

    def serve(self, messages: AsyncIterator[str]) -> None:
        """Serve a client that sends these messages until it is disconnected."""
        services = SteeringServices(
            hardware=self.hardware,
            calibration=cast(Any, SimpleNamespace(current=None)),  # it steers by volts
            overlay=cast(Any, None),
            lease=self.lease,
            events=self.setup.events,
        )
        self.client.messages = messages
        session = SteeringSession(services, cast(Any, self.client))
        with pytest.raises(WebSocketDisconnect):
            asyncio.run(asyncio.wait_for(session.run(), PATIENCE_S))

    @property
    def presses(self) -> int:
        """How often somebody began to steer."""
        return sum(event.kind == "mirrors.steered" for event in self.setup.events.recent(200))


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[Bench]:
    with hardware_setup(tmp_path) as setup:
        yield Bench(setup)


def test_mirrors_are_parked_after_their_client_was_lost(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(hand_steering, "PARK_S", 0.2)

    async def messages() -> AsyncIterator[str]:
        yield BEGIN
        while bench.mirrors.volts != THERE:
            yield steer(THERE)

    bench.serve(messages())

    bench.setup.wait_for("mirrors.parked")
    assert bench.mirrors.volts == PARKED


def test_mirrors_stay_where_they_are_when_another_takes_the_lease(bench: Bench) -> None:
    async def messages() -> AsyncIterator[str]:
        yield BEGIN
        while bench.mirrors.volts != THERE:
            yield steer(THERE)
        bench.lease.take(LeaseClaim(holder="Eve"))
        while bench.client.status != "ended" and bench.mirrors.volts != ASIDE:
            yield steer(ASIDE)

    bench.serve(messages())

    assert (bench.client.status, bench.mirrors.volts) == ("ended", THERE)


def test_after_a_stop_a_key_that_is_still_held_moves_nothing(bench: Bench) -> None:
    presses = list[int]()

    async def messages() -> AsyncIterator[str]:
        yield BEGIN
        while bench.mirrors.volts != THERE:
            yield steer(THERE)
        bench.hardware.halt()
        while bench.client.status != "ended":
            yield steer(THERE)
        bench.hardware.resume()
        for _ in range(5):
            yield steer(ASIDE)
        presses.append(bench.presses)
        yield RELEASE
        while bench.mirrors.volts != ASIDE:
            yield steer(ASIDE)

    bench.serve(messages())

    assert (presses, bench.presses) == ([1], 2)
