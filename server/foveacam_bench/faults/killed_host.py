"""A process that drives the mirrors as a server does until it is killed: `--port PORT --seed N`.

It opens a serial rig with its guardian, prints that it is ready, and moves the mirrors.
"""

import argparse
import random
import sys
import time

from foveacam_hardware.contract import FoveaError, MirrorVolts, StereoVolts
from foveacam_hardware.rig import open_rig
from foveacam_hardware.rig_config import SerialMirrorsConfig, SerialRigConfig

PERIOD_S = 0.005
LARGEST_V = 160.0


def main() -> None:
    """Run until killed."""
    options = argparse.ArgumentParser(description="a host to be killed")
    options.add_argument("--port", required=True)
    options.add_argument("--seed", type=int, required=True)
    given = options.parse_args()
    rng = random.Random(given.seed)  # noqa: S311 - not a secret
    config = SerialRigConfig(
        kind="serial", rig_id="to-be-killed", mirrors=SerialMirrorsConfig(port=given.port)
    )
    mirrors = open_rig(config, guarded=True).mirrors
    mirrors.connect()
    if not mirrors.state.guarded:
        sys.exit("no guardian")
    mirrors.steer(random_volts(rng))
    sys.stdout.write("ready\n")
    sys.stdout.flush()
    while True:
        try:
            if rng.random() < 0.1:
                mirrors.expose(random_volts(rng), settle_us=14_000, pulse_us=4000)
            else:
                mirrors.steer(random_volts(rng))
        except FoveaError as error:
            sys.stderr.write(f"{error}\n")
        time.sleep(PERIOD_S)


def random_volts(rng: random.Random) -> StereoVolts:
    """Return random volts for both mirrors, never the rest position."""
    values = [rng.choice((-1, 1)) * rng.uniform(1.0, LARGEST_V) for _ in range(4)]
    return StereoVolts(
        left=MirrorVolts(x_v=values[0], y_v=values[1]), right=MirrorVolts(x_v=values[2], y_v=values[3])
    )


if __name__ == "__main__":
    main()
