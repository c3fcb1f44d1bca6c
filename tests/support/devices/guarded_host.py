"""A host for tests of its guardian: `guarded_host.py PORT ENDING` connects, steers aside, and ends so.

ENDING: `wait` (to be killed), `close` (as it should be), `leave` (without closing anything).
"""

import sys
import threading

from foveacam_hardware.contract import MirrorVolts, MonotonicClock, StereoVolts
from foveacam_hardware.drivers.controller.guard import LinkSupervision
from foveacam_hardware.drivers.controller.guardian import Guardian
from foveacam_hardware.drivers.controller.mirrors import ControllerMirrors
from foveacam_hardware.wire.link import SerialLink

ASIDE = StereoVolts(left=MirrorVolts(x_v=90.0, y_v=-80.0), right=MirrorVolts(x_v=-70.0, y_v=60.0))


def main(port: str, ending: str) -> None:
    guardian = Guardian()
    supervision = LinkSupervision(guardian=guardian, answer_s=5.0)
    mirrors = ControllerMirrors(lambda: SerialLink(port), MonotonicClock(), supervision=supervision)
    mirrors.connect()
    mirrors.steer(ASIDE)
    mirrors.ping()
    sys.stdout.write(f"ready {guardian.pid} {mirrors.state.guarded}\n")
    sys.stdout.flush()
    if ending == "wait":
        threading.Event().wait()
    elif ending == "close":
        mirrors.close()


if __name__ == "__main__":
    main(*sys.argv[1:])
