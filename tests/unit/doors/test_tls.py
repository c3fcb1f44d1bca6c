"""Certificates that a server cannot use are named before it starts."""

import ssl
from pathlib import Path

import pytest
from tests.support.servers.certificates import written_certificate

from foveacam_hardware.contract import InvalidInput
from foveacam_server.doors.listening_socket import tls_context


def test_a_certificate_with_its_key_is_used(tmp_path: Path) -> None:
    context = tls_context(*written_certificate(tmp_path, "127.0.0.1"))
    assert context is not None and context.minimum_version is ssl.TLSVersion.TLSv1_2
    assert tls_context(None, None) is None


def test_one_without_the_other_is_refused(tmp_path: Path) -> None:
    certificate, key = written_certificate(tmp_path, "127.0.0.1")
    with pytest.raises(InvalidInput, match="give --tls-key too"):
        tls_context(certificate, None)
    with pytest.raises(InvalidInput, match="give --tls-cert too"):
        tls_context(None, key)


def test_what_cannot_be_used_is_named_with_a_remedy(tmp_path: Path) -> None:
    certificate, key = written_certificate(tmp_path / "a", "127.0.0.1")
    _, other = written_certificate(tmp_path / "b", "127.0.0.1")
    _, locked = written_certificate(tmp_path / "c", "127.0.0.1", pass_phrase="secret")  # noqa: S106 - of this test
    with pytest.raises(InvalidInput, match=r"server\.key is the key of another certificate"):
        tls_context(certificate, other)
    with pytest.raises(InvalidInput, match="no certificate and key in PEM"):
        tls_context(key, key)
    with pytest.raises(InvalidInput, match="No such file"):
        tls_context(tmp_path / "none.crt", key)
    with pytest.raises(InvalidInput, match="openssl pkey"):
        tls_context(tmp_path / "c" / "server.crt", locked)
