"""Compile the kernels of the simulated rig and of depth, once for all workers of the tests."""

from foveacam_hardware.sim.render import warm_up
from foveacam_pipeline.networks.known_pair import known_pair
from foveacam_pipeline.stereo.live import match_live

warm_up()
match_live(known_pair().pair)
