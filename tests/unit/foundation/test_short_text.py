import pytest

from foveacam_server.foundation.plain_words import shorten


@pytest.mark.parametrize(
    ("long", "short"),
    [
        ("9" * 400, "1e+400"),
        ("-" + str(10**308) + ".00 ms", "-1e+308 ms"),
        ("123456789" * 3, "1.23457e+26"),
        ("x" * 1000 + " y", "x" * 80 + "… y"),
    ],
)
def test_what_nobody_reads_is_cut(long: str, short: str) -> None:
    assert shorten(f"asked: {long}") == f"asked: {short}"


@pytest.mark.parametrize(
    "text",
    [
        f'the text "{"0" * 40}…"; nothing is at /samples/{"1" * 64}.jpg',
        "t_ns = 1764021600000000000 is too late",
        "cap-" + "0123456789abcdef" * 2,
        "the folder /data/" + "capture/" * 20 + " is full; 0.00000000000000000000001",
    ],
)
def test_what_is_meant_to_be_read_stays(text: str) -> None:
    assert shorten(text) == text
