"""Look at several pixels of the wide view one after the other, and follow the events meanwhile."""

import asyncio
import sys

import foveacam_client
from foveacam_client import AsyncRig


async def print_events(rig: AsyncRig) -> None:
    """Print the rig's events until this task is cancelled."""
    async for event in rig.events(kinds=["fixation.done", "stop.engaged"]):
        print(event.t_utc, event.message, file=sys.stderr)


async def main(places_px: list[tuple[float, float]]) -> None:
    """Fixate each place and print its distance."""
    async with foveacam_client.connect_async() as rig:
        events = asyncio.create_task(print_events(rig))
        for x_px, y_px in places_px:
            fixation = await rig.fixate(x_px, y_px)
            print(x_px, y_px, fixation.basis, fixation.distance_m, fixation.distance_sigma_m)
        events.cancel()


if __name__ == "__main__":
    numbers = [float(word) for word in sys.argv[1:]]
    asyncio.run(main(list(zip(numbers[::2], numbers[1::2], strict=True))))
