"""Descriptions (GenICam XML) of cameras with more features than libaravis' fake one, on its plain memory.

A feature is a register that keeps what is written: what a camera would do with it, a test does by hand.
"""

import ctypes
from ctypes import POINTER, byref, c_char_p, c_size_t, c_void_p

from foveacam_hardware.drivers.cameras.aravis.library import LIBRARY

EXPOSURE_AUTO_AT, RATE_BY_HAND_AT, RESULTING_AT = 0x1F00, 0x1F04, 0x1F08
"""Where nothing else of the fake camera is."""
BINNING_MODES_AT = (0x1F10, 0x1F14)
OFF, CONTINUOUS, ONCE = 0, 1, 2
"""The values of ExposureAuto, as chosen here."""
_END = "</RegisterDescription>"
_REGISTER = """
<IntReg Name="{name}" NameSpace="Custom"><Address>{address}</Address><Length>4</Length>
<AccessMode>RW</AccessMode><pPort>Device</pPort><Sign>Unsigned</Sign><Endianess>BigEndian</Endianess></IntReg>
"""
_AUTOMATIC = """
<Enumeration Name="ExposureAuto" NameSpace="Standard">
<EnumEntry Name="Off" NameSpace="Standard"><Value>0</Value></EnumEntry>
<EnumEntry Name="Continuous" NameSpace="Standard"><Value>1</Value></EnumEntry>
<EnumEntry Name="Once" NameSpace="Standard"><Value>2</Value></EnumEntry>
<pValue>ExposureAutoRegister</pValue></Enumeration>
<Boolean Name="AcquisitionFrameRateEnable" NameSpace="Standard">
<pValue>RateByHandRegister</pValue><OnValue>1</OnValue><OffValue>0</OffValue></Boolean>
<Converter Name="AcquisitionResultingFrameRate" NameSpace="Standard">
<FormulaTo>FROM</FormulaTo><FormulaFrom>TO</FormulaFrom><pValue>ResultingRegister</pValue></Converter>
"""


_BINNING_MODE = """
<Enumeration Name="{axis}Mode" NameSpace="Standard">{entries}<pValue>{axis}ModeRegister</pValue></Enumeration>
"""
_ENTRY = '<EnumEntry Name="{name}" NameSpace="Standard"><Value>{value}</Value></EnumEntry>'


def fake_cameras_own() -> str:
    """Return what libaravis' fake camera says of itself."""
    library = ctypes.CDLL(LIBRARY)
    library.arv_fake_device_new.restype = c_void_p
    library.arv_fake_device_new.argtypes = (c_char_p, c_void_p)
    library.arv_device_get_genicam_xml.restype = c_void_p
    library.arv_device_get_genicam_xml.argtypes = (c_void_p, POINTER(c_size_t))
    library.g_object_unref.argtypes = (c_void_p,)
    device, size = library.arv_fake_device_new(b"1", None), c_size_t()
    text = ctypes.string_at(library.arv_device_get_genicam_xml(device, byref(size)), size.value).decode()
    library.g_object_unref(device)
    return text


def with_automatic_modes() -> str:
    """Return the description of a camera that can set exposure and rate itself."""
    registers = (
        ("ExposureAutoRegister", EXPOSURE_AUTO_AT),
        ("RateByHandRegister", RATE_BY_HAND_AT),
        ("ResultingRegister", RESULTING_AT),
    )
    added = "".join(_REGISTER.format(name=name, address=address) for name, address in registers)
    return fake_cameras_own().replace(_END, added + _AUTOMATIC + _END)


def with_binning_modes(*names: str) -> str:
    """Return the description of a camera that bins in these modes, of which the first is in force.

    It delivers as many pixels as Width and Height say, whatever its binning.
    """
    entries = "".join(_ENTRY.format(name=name, value=value) for value, name in enumerate(names))
    added = ""
    for axis, address in zip(("BinningHorizontal", "BinningVertical"), BINNING_MODES_AT, strict=True):
        added += _REGISTER.format(name=f"{axis}ModeRegister", address=address)
        added += _BINNING_MODE.format(axis=axis, entries=entries)
    return fake_cameras_own().replace(_END, added + _END)
