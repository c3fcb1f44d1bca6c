"""Names of the dictionaries of square markers, apart from OpenCV, which the command line loads when used."""

from typing import Literal, TypeAlias

DictionaryName: TypeAlias = Literal[
    "4X4_50",
    "4X4_100",
    "4X4_250",
    "4X4_1000",
    "5X5_50",
    "5X5_100",
    "5X5_250",
    "5X5_1000",
    "6X6_50",
    "6X6_100",
    "6X6_250",
    "6X6_1000",
    "7X7_50",
    "7X7_100",
    "7X7_250",
    "7X7_1000",
]
