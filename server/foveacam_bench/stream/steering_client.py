"""The client of the steering bench, a separate program: `PORT SECONDS`; prints as JSON what it sent."""

import asyncio
import json
import sys
import time

from websockets.asyncio.client import ClientConnection, connect

from foveacam_bench.stream.clients import StreamViewer

PERIOD_S = 0.016
"""Period of a pointer's moves."""
VALUE_V = 15.0
AXES = (("left", "x_v"), ("left", "y_v"), ("right", "x_v"), ("right", "y_v"))
BEGIN_S = 2.0
"""Time until the live views run."""


async def steer(port: int, seconds: float) -> list[dict[str, float]]:
    """Steer, one axis after the other from one side to the other, and return what was sent when."""
    api = f"ws://127.0.0.1:{port}/api/v1"
    viewer = StreamViewer(f"{api}/views/ws", {"wide": 2, "left": 2, "right": 2})
    watching = asyncio.create_task(viewer.watch())
    await asyncio.sleep(BEGIN_S)
    sent: list[dict[str, float]] = []
    volts = {"left": {"x_v": -VALUE_V, "y_v": -VALUE_V}, "right": {"x_v": -VALUE_V, "y_v": -VALUE_V}}
    async with connect(f"{api}/mirrors/steering", compression=None, proxy=None) as socket:
        await socket.send(json.dumps({"type": "begin", "name": "bench"}))
        reading = asyncio.create_task(_read(socket))
        for _ in range(round(0.5 / PERIOD_S)):
            await socket.send(json.dumps({"type": "steer", "held": True, "volts": volts}))
            await asyncio.sleep(PERIOD_S)
        for number in range(round(seconds / PERIOD_S)):
            axis = number % len(AXES)
            eye, name = AXES[axis]
            volts[eye][name] = -volts[eye][name]
            message = json.dumps({"type": "steer", "held": True, "volts": volts})
            sent.append({"t_ns": time.monotonic_ns(), "axis": axis, "value_v": volts[eye][name]})
            await socket.send(message)
            await asyncio.sleep(PERIOD_S)
        await socket.send(json.dumps({"type": "steer", "held": False}))
        reading.cancel()
    watching.cancel()
    await asyncio.gather(watching, reading, return_exceptions=True)
    return sent


async def _read(socket: ClientConnection) -> None:
    """Read and discard the server's messages."""
    async for _ in socket:
        continue


if __name__ == "__main__":
    sys.stdout.write(json.dumps(asyncio.run(steer(int(sys.argv[1]), float(sys.argv[2])))))
