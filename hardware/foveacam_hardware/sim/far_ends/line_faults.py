"""Damage done on purpose to the bytes of a serial line, in either direction."""

from dataclasses import dataclass, field
from enum import StrEnum


class DamageKind(StrEnum):
    """What happens to a byte."""

    DROP = "drop"
    CORRUPT = "corrupt"
    INSERT = "insert"


@dataclass(frozen=True, slots=True, kw_only=True)
class LineDamage:
    """One fault: it hits the byte that comes after `skip` others, and `count - 1` more behind it.

    CORRUPT flips the bits of `value` (0 becomes something else, and never a delimiter by design of
    the test); INSERT puts `count` bytes of `value` before the byte hit.
    """

    kind: DamageKind
    skip: int = 0
    count: int = 1
    value: int = 0x55


@dataclass(slots=True)
class LineFaults:
    """The faults still to come in one direction, done one after the other."""

    pending: list[LineDamage] = field(default_factory=list)
    _passed: int = 0

    def add(self, damage: LineDamage) -> None:
        """Let `damage` happen, once those before it have."""
        self.pending.append(damage)

    def clear(self) -> None:
        """Heal the line."""
        self.pending.clear()
        self._passed = 0

    def apply(self, data: bytes) -> bytes:
        """Return what is left of `data` on the far side of the line."""
        if not self.pending:
            return data
        arrived = bytearray()
        for byte in data:
            arrived += self._pass_one(byte)
        return bytes(arrived)

    def _pass_one(self, byte: int) -> bytes:
        if not self.pending:
            return bytes((byte,))
        damage = self.pending[0]
        at = self._passed - damage.skip
        self._passed += 1
        if at < 0:
            return bytes((byte,))
        if damage.kind is DamageKind.INSERT or at == damage.count - 1:
            self.pending.pop(0)
            self._passed = 0
        match damage.kind:
            case DamageKind.DROP:
                return b""
            case DamageKind.CORRUPT:
                return bytes((byte ^ damage.value,))
            case DamageKind.INSERT:
                return bytes((damage.value,)) * damage.count + bytes((byte,))
