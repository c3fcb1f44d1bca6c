"""The certificate by which a server speaks https: checked before the server starts, in plain words."""

import ssl
from pathlib import Path

from foveacam_hardware.contract import InvalidInput

_MINIMUM = ssl.TLSVersion.TLSv1_2


def tls_context(certificate: Path | None, key: Path | None) -> ssl.SSLContext | None:
    """Return the server's side of TLS; None where neither file is given, for plain http.

    Raise `InvalidInput` for one without the other, files that cannot be read or are no PEM, a key that is
    another certificate's, and one with a pass phrase.
    """
    if certificate is None and key is None:
        return None
    if certificate is None or key is None:
        missing = "--tls-cert" if certificate is None else "--tls-key"
        raise InvalidInput(
            f"a certificate and its key belong together; give {missing} too", found=f"no {missing}"
        )
    for path in (certificate, key):
        _check_readable(path)
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.minimum_version = _MINIMUM
    try:
        context.load_cert_chain(certificate, key, password=_no_pass_phrase)
    except ssl.SSLError as error:
        raise _refusal(certificate, key, error) from error
    return context


def _check_readable(path: Path) -> None:
    try:
        path.read_bytes()
    except OSError as error:
        raise InvalidInput(
            f"{path} cannot be read: {error.strerror}; give the path of a PEM file",
            asked=str(path),
            found=error.strerror,
            remedy="give the path of a PEM file",
        ) from error


def _no_pass_phrase() -> str:
    raise InvalidInput(
        "the key has a pass phrase, which nobody types when a server starts by itself; give one without: "
        "openssl pkey -in KEY -out NEW",
        found="a key with a pass phrase",
        remedy="openssl pkey -in KEY -out NEW",
    )


def _refusal(certificate: Path, key: Path, error: ssl.SSLError) -> InvalidInput:
    if error.reason == "KEY_VALUES_MISMATCH":
        found, remedy = (
            f"{key} is the key of another certificate",
            "give the key that the certificate was made with",
        )
    else:
        found, remedy = f"no certificate and key in PEM ({error.reason or error})", "give both as PEM files"
    return InvalidInput(
        f"cannot serve https by {certificate} and {key}: {found}; {remedy}",
        asked=f"{certificate} and {key}",
        found=found,
        remedy=remedy,
    )
