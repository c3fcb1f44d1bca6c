"""The yardstick of our serial path: plain pyserial, no framing, no thread, against a port that echoes."""

import time

import serial

ECHO_TIMEOUT_S = 2.0


def bare_round_trips_ms(port: str, *, data: bytes, count: int) -> list[float]:
    """Return the times of `count` writes of `data`, each read back whole, ms."""
    times_ms = []
    with serial.Serial(port, 115_200, timeout=ECHO_TIMEOUT_S) as line:
        for _ in range(count):
            began_ns = time.perf_counter_ns()
            line.write(data)
            echo = line.read(len(data))
            times_ms.append((time.perf_counter_ns() - began_ns) / 1e6)
            if echo != data:
                raise ValueError(f"{port} does not echo: sent {data.hex(' ')}, read {echo.hex(' ')}")
    return times_ms
