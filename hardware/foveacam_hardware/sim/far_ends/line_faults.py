"""Faults of a simulated serial line: lost, corrupted and inserted bytes, in one direction."""

from dataclasses import dataclass, field
from enum import StrEnum


class DamageKind(StrEnum):
    """The kind of damage to a byte."""

    DROP = "drop"
    CORRUPT = "corrupt"
    INSERT = "insert"


@dataclass(frozen=True, slots=True, kw_only=True)
class LineDamage:
    """One fault: it damages the byte after `skip` others, and the next `count - 1`.

    CORRUPT flips the bits of `value` (a test chooses it so that no delimiter results); INSERT puts `count`
    bytes of `value` before the byte.
    """

    kind: DamageKind
    skip: int = 0
    count: int = 1
    value: int = 0x55


@dataclass(slots=True)
class LineFaults:
    """The pending faults of one direction, applied one after the other."""

    pending: list[LineDamage] = field(default_factory=list)
    _passed: int = 0

    def add(self, damage: LineDamage) -> None:
        """Append a fault to the pending ones."""
        self.pending.append(damage)

    def clear(self) -> None:
        """Cancel the pending faults."""
        self.pending.clear()
        self._passed = 0

    def apply(self, data: bytes) -> bytes:
        """Return the bytes that arrive when `data` is sent."""
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
