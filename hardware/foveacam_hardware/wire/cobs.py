"""Consistent overhead byte stuffing (COBS): packets without zero bytes, each terminated by one zero.

A run of n non-zero bytes followed by a zero is sent as n + 1 and the run; 0xFF marks a run of 254 bytes that
is not followed by a zero.
"""

_FULL_RUN = 254
DELIMITER = b"\x00"


def cobs_encode(data: bytes) -> bytes:
    """Return the stuffed bytes of `data`, delimiter included."""
    stuffed = bytearray()
    pieces = data.split(b"\x00")
    for piece in pieces:
        rest = piece
        while len(rest) >= _FULL_RUN:
            stuffed.append(0xFF)
            stuffed += rest[:_FULL_RUN]
            rest = rest[_FULL_RUN:]
            if not rest and piece is pieces[-1]:
                break  # the data ended with a full run: no further block follows
        else:
            stuffed.append(len(rest) + 1)
            stuffed += rest
    return bytes(stuffed) + DELIMITER


def cobs_decode(stuffed: bytes) -> bytes | None:
    """Return the data of one frame (delimiter cut off), or None when its run lengths do not add up."""
    data = bytearray()
    at = 0
    while at < len(stuffed):
        code = stuffed[at]
        run = stuffed[at + 1 : at + code]
        if code == 0 or len(run) != code - 1 or 0 in run:
            return None
        data += run
        at += code
        if code != 0xFF and at < len(stuffed):
            data.append(0)
    return bytes(data)


class CobsDecoder:
    """Splits a byte stream into frames; resynchronises at the next delimiter after any garbage."""

    def __init__(self, *, max_frame_bytes: int = 512) -> None:
        self._max_frame_bytes = max_frame_bytes
        self._pending = bytearray()
        self._overlong = False

    def feed(self, data: bytes) -> list[bytes | None]:
        """Return the frames that `data` completes, in order; None for each one that is malformed.

        Two consecutive delimiters give b""; interpreting it is left to the caller.
        """
        *ends, rest = data.split(DELIMITER)
        frames = [self._finish(end) for end in ends]
        self._extend(rest)
        return frames

    def reset(self) -> None:
        """Discard a partially received frame."""
        self._pending.clear()
        self._overlong = False

    def _extend(self, piece: bytes) -> None:
        self._pending += piece
        if len(self._pending) > self._max_frame_bytes:
            self._pending.clear()
            self._overlong = True

    def _finish(self, last: bytes) -> bytes | None:
        self._extend(last)
        frame = None if self._overlong else cobs_decode(bytes(self._pending))
        self.reset()
        return frame
