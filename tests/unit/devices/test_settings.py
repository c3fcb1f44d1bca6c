from pathlib import Path

import pytest
from pydantic import ValidationError

from foveacam_hardware.contract import InvalidInput
from foveacam_server.foundation.settings import Settings, checked_settings, default_data_dir, given_token
from foveacam_server.serving import keep_token


def test_environment_is_read_and_arguments_win(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FOVEACAM_PORT", "9001")
    monkeypatch.setenv("FOVEACAM_SCENE", "street")
    settings = Settings(port=9002)
    assert (settings.port, settings.scene) == (9002, "street")


def test_data_goes_where_the_desktop_keeps_data(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", "/elsewhere")
    assert default_data_dir() == Path("/elsewhere/foveacam")
    monkeypatch.delenv("XDG_DATA_HOME")
    monkeypatch.setenv("HOME", "/home/ada")
    assert default_data_dir() == Path("/home/ada/.local/share/foveacam")


@pytest.mark.parametrize(
    ("host", "loopback"),
    [
        ("127.0.0.1", True),
        ("127.8.8.8", True),
        ("::1", True),
        ("localhost", True),
        ("0.0.0.0", False),  # noqa: S104 - the case that needs a token
        ("192.168.1.5", False),
        ("camera.example", False),
    ],
)
def test_only_this_machine_reaches_a_loopback_address(host: str, loopback: bool) -> None:
    assert Settings(host=host).loopback is loopback


def test_token_is_not_shown_when_settings_are_printed() -> None:
    assert "correct horse" not in repr(Settings(token="correct horse"))  # type: ignore[arg-type]  # noqa: S106


@pytest.mark.parametrize("port", [-1, 65536])
def test_port_outside_the_range_is_refused(port: int) -> None:
    with pytest.raises(ValidationError):
        Settings(port=port)


def test_automatic_token_is_long_and_new_every_time() -> None:
    wanted = Settings(token="auto")  # type: ignore[arg-type]  # noqa: S106
    assert wanted.wants_token_made
    tokens = [wanted.with_made_token().token for _ in range(2)]
    made_up = {token.get_secret_value() for token in tokens if token is not None}
    assert len(made_up) == 2
    assert min(map(len, made_up)) >= 20


def test_short_token_is_refused_with_the_length_that_is_needed() -> None:
    with pytest.raises(ValueError, match="at least 12 characters, this one 5"):
        Settings(token="short")  # type: ignore[arg-type]  # noqa: S106


@pytest.mark.parametrize(
    "endpoint", ["127.0.0.1:4318", "ftp://collector:4318", "http://", "http://ada:secret@collector:4318"]
)
def test_what_is_no_address_of_a_collector_is_refused_without_its_password(endpoint: str) -> None:
    with pytest.raises(InvalidInput, match="the address of a collector is like") as refused:
        checked_settings({"otlp_endpoint": endpoint})
    assert "secret" not in str(refused.value)


def test_another_format_of_the_log_is_refused_with_those_there_are() -> None:
    with pytest.raises(InvalidInput, match="needed is one of 'text' or 'json'"):
        checked_settings({"log_format": "xml"})


def test_made_token_is_kept_for_its_owner_alone(tmp_path: Path) -> None:
    for _ in range(2):  # another start replaces it
        settings = Settings(token="auto", data=tmp_path / "new").with_made_token()  # type: ignore[arg-type]  # noqa: S106
        path = keep_token(settings)
        assert settings.token is not None
        assert path.read_text() == settings.token.get_secret_value() + "\n"
        assert path.stat().st_mode & 0o777 == 0o600


def test_folder_that_cannot_take_the_token_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    settings = Settings(token="auto", data=tmp_path / "file").with_made_token()  # type: ignore[arg-type]  # noqa: S106
    with pytest.raises(InvalidInput, match="another --data folder"):
        keep_token(settings)


def test_a_token_comes_from_a_file_or_is_made_never_from_the_command_line(tmp_path: Path) -> None:
    file = tmp_path / "token"
    file.write_text("a token of our own\n")
    assert given_token(None, file) == "a token of our own"
    assert (given_token("auto", None), given_token(None, None)) == ("auto", None)
    with pytest.raises(InvalidInput, match="--token-file FILE, set FOVEACAM_TOKEN"):
        given_token("a token of our own", None)
    with pytest.raises(InvalidInput, match="No such file"):
        given_token(None, tmp_path / "none")
