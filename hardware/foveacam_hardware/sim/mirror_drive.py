"""The drive electronics that the controller's firmware controls: two quad DACs, rail, filter clock.

It takes the DACs' 3-byte words (AD5664R data sheet, table of command definitions) and reports codes to
`Cables`; volts, filters and mirrors belong to the world.
"""

from foveacam_hardware.sim.cables import NO_CODES, Cables
from foveacam_hardware.wire.controller_payloads import MirrorCodes

ALL_CHANNELS = 7
_CHANNEL_LETTERS = (0, 1, 3, 2)  # ch0→A, ch1→B, ch2→D, ch3→C, as the board is routed
_WRITE_INPUT, _UPDATE, _WRITE_UPDATE_ALL, _WRITE_UPDATE = 0, 1, 2, 3
_POWER, _RESET, _LOAD_MODE, _REFERENCE = 4, 5, 6, 7

START_WORDS = (0x280001, 0x380001, 0x20000F, 0x300000)
"""Reset, internal reference on, all channels powered, software load; sent at ENABLE."""

RECOVERY_WORDS = (0x20000F, 0x380001, 0x300000)
"""Sent once a second while enabled, in case a DAC has lost its settings."""

UPDATE_WORD = 0x0F0000


def bias_word(code: int) -> int:
    """Return the word that writes `code` to all four channels."""
    return _word(_WRITE_UPDATE, ALL_CHANNELS, code)


def target_words(codes: MirrorCodes) -> tuple[int, ...]:
    """Return the words that write one mirror's four codes to its DAC and load them."""
    writes = (
        _word(_WRITE_UPDATE, letter, code) for letter, code in zip(_CHANNEL_LETTERS, codes, strict=True)
    )
    return *writes, UPDATE_WORD


def _word(command: int, channel: int, value: int) -> int:
    return (command << 3 | channel) << 16 | value


class QuadDac:
    """One AD5664R: registers, power and reference, controlled by 24-bit words."""

    def __init__(self) -> None:
        self._reset()

    def _reset(self) -> None:
        self._inputs = [0, 0, 0, 0]
        self._outputs = [0, 0, 0, 0]
        self._powered = True
        self._reference = False

    @property
    def codes(self) -> MirrorCodes:
        """The codes in force in the board's order x+, x−, y+, y−; zeros without power."""
        if not (self._powered and self._reference):
            return 0, 0, 0, 0
        a, b, c, d = self._outputs
        return a, b, d, c

    def write(self, word: int) -> None:
        """Execute one word."""
        command, channel, value = word >> 19, word >> 16 & 7, word & 0xFFFF
        channels = range(4) if channel == ALL_CHANNELS else (channel,)
        if command in (_WRITE_INPUT, _WRITE_UPDATE, _WRITE_UPDATE_ALL):
            for index in channels:
                self._inputs[index] = value
        if command == _WRITE_UPDATE_ALL:
            channels = range(4)
        if command in (_UPDATE, _WRITE_UPDATE, _WRITE_UPDATE_ALL):
            for index in channels:
                self._outputs[index] = self._inputs[index]
        self._configure(command, value)

    def _configure(self, command: int, value: int) -> None:
        if command == _RESET:
            self._reset()
        elif command == _POWER:
            self._powered = value & 0x3F == 0x0F
        elif command == _REFERENCE:
            self._reference = bool(value & 1)


class MirrorDrive:
    """Both DACs, the rail and the filter clock; every change is reported to the cables."""

    def __init__(self, cables: Cables) -> None:
        self._cables = cables
        self._left = QuadDac()
        self._right = QuadDac()
        self._codes = NO_CODES
        self._rail = False
        self._cutoff_hz = 0
        self.words: list[tuple[int, int]] = []
        """The last words written to the left and right DAC, for tests of the SPI bus."""

    def set_rail(self, t_ns: int, *, on: bool) -> None:
        """Switch the high voltage."""
        if on != self._rail:
            self._rail = on
            self._cables.set_rail(t_ns, on=on)

    def set_low_pass(self, t_ns: int, cutoff_hz: int) -> None:
        """Set the filter clock for `cutoff_hz`; 0 stops it."""
        if cutoff_hz != self._cutoff_hz:
            self._cutoff_hz = cutoff_hz
            self._cables.set_low_pass(t_ns, cutoff_hz)

    def set_up_dacs(self, t_ns: int, *, bias_code: int) -> None:
        """Set the DACs up and write the bias to every channel."""
        self._send(t_ns, (*START_WORDS, bias_word(bias_code)), (*START_WORDS, bias_word(bias_code)))

    def write_bias(self, t_ns: int, *, bias_code: int) -> None:
        """Write the bias to every channel."""
        self._send(t_ns, (bias_word(bias_code),), (bias_word(bias_code),))

    def write_target(self, t_ns: int, left: MirrorCodes, right: MirrorCodes) -> None:
        """Write the target codes of both mirrors."""
        self._send(t_ns, target_words(left), target_words(right))

    def rewrite_settings(self, t_ns: int) -> None:
        """Write the DACs' settings again, without changing the outputs."""
        self._send(t_ns, RECOVERY_WORDS, RECOVERY_WORDS)

    def lose_power(self, t_ns: int) -> None:
        """Lose the supply: reset the DACs, rail and filter clock off."""
        self._left, self._right = QuadDac(), QuadDac()
        self.set_rail(t_ns, on=False)
        self.set_low_pass(t_ns, 0)
        self._report_codes(t_ns)

    def _send(self, t_ns: int, left_words: tuple[int, ...], right_words: tuple[int, ...]) -> None:
        self.words = list(zip(left_words, right_words, strict=True))
        for left_word, right_word in self.words:
            self._left.write(left_word)
            self._right.write(right_word)
        self._report_codes(t_ns)

    def _report_codes(self, t_ns: int) -> None:
        codes = (*self._left.codes, *self._right.codes)
        if codes != self._codes:
            self._codes = codes
            self._cables.set_codes(t_ns, codes)
