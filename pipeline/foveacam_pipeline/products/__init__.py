"""Products of many datasets: depth, mosaics, exports, evaluations, each under the hash of its inputs."""
