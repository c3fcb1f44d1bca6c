"""The key of a data directory, by which cookies are signed; only its owner can read the file."""

import secrets
from pathlib import Path

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.storage.disk import PRIVATE
from foveacam_server.foundation.private_files import make_private
from foveacam_server.foundation.whole_file import write_whole

KEY_FILE = "sign_in.key"
_KEY_BYTES = 32
_KEY_CHARS = 2 * _KEY_BYTES


class SigningKey:
    """The key, in memory and in its file.

    Without the file, the next start makes another key, which invalidates all earlier cookies: so a sign-out
    holds even if it cannot be written.
    """

    def __init__(self, folder: Path) -> None:
        """Read the key, or make one; raise `InvalidInput` for a file that is not a key."""
        self._path = folder / KEY_FILE
        found = self._read()
        self.is_new = found is None
        """Whether the key is new, so that earlier cookies are invalid."""
        self.text = found or secrets.token_hex(_KEY_BYTES)
        self._kept = not self.is_new

    def keep(self) -> None:
        """Write the file where it is missing; raise `StorageFull` or `DeviceFault`."""
        if not self._kept:
            write_whole(self._path, self.text, what="the key that signs cookies", mode=PRIVATE)
            self._kept = True

    def void(self) -> None:
        """Remove the file, which needs no free space; raise `OSError`."""
        self._path.unlink(missing_ok=True)
        self._kept = False

    def _read(self) -> str | None:
        try:
            make_private(self._path)
            found = self._path.read_bytes()
        except FileNotFoundError:
            return None
        except OSError as error:
            raise self._refused(f"it cannot be read ({error.strerror})") from error
        text = found.decode("ascii", errors="replace")
        if len(text) < _KEY_CHARS or not text.isascii():
            raise self._refused(f"it has {len(found)} bytes instead of {_KEY_CHARS} hexadecimal digits")
        return text

    def _refused(self, found: str) -> InvalidInput:
        return InvalidInput(
            f"{self._path} is no key that cookies could be signed by: {found}",
            asked=str(self._path),
            found=found,
            remedy="restore it, or remove it: a new one is made, and everybody signs in again",
        )
