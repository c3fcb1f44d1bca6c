"""The listening socket, bound before the server starts, and the certificate for https.

The socket has small send buffers, which connections inherit. The certificate is checked before the server
starts, with readable errors.
"""

import errno
import socket
import ssl
from pathlib import Path

from foveacam_hardware.contract import Busy, FoveaError, InvalidInput

SEND_BUFFER_BYTES = 128 * 1024
"""Send buffer of about one picture: more in the kernel would be outdated when it is sent (default: up to 4
MB)."""
_BACKLOG = 256
_MINIMUM = ssl.TLSVersion.TLSv1_2


def listen(host: str, port: int) -> socket.socket:
    """Return a listening TCP socket for `uvicorn.Server.serve(sockets=[…])`; port 0 lets the system choose.

    Raise `Busy` when the port is taken, `InvalidInput` when the address cannot be used at all.
    """
    try:
        family = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0][0]
        # asyncio sends small answers at once only on sockets that name the protocol; Nagle's algorithm
        # otherwise waits for the acknowledgement of the one before, 40 ms
        listener = socket.socket(family, socket.SOCK_STREAM, socket.IPPROTO_TCP)
    except OSError as error:
        raise _refusal(error, host=host, port=port) from error
    try:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SEND_BUFFER_BYTES)
        listener.bind((host, port))
        listener.listen(_BACKLOG)
    except OSError as error:
        listener.close()
        raise _refusal(error, host=host, port=port) from error
    listener.setblocking(False)
    return listener


def _refusal(error: OSError, *, host: str, port: int) -> FoveaError:
    asked, found = f"{host} port {port}", error.strerror or str(error)
    if error.errno == errno.EADDRINUSE:
        return Busy(
            f"port {port} on {host} is in use by another program",
            asked=asked,
            found=found,
            remedy=f"stop it, or choose another with --port {port + 1 if port < 65535 else 0}",
        )
    return InvalidInput(
        f"cannot listen on {asked}: {found}",
        asked=asked,
        found=found,
        remedy="choose another --host or --port",
    )


def tls_context(certificate: Path | None, key: Path | None) -> ssl.SSLContext | None:
    """Return the server's side of TLS; None where neither file is given, for plain http.

    Raise `InvalidInput` for one file without the other, files that cannot be read or are not PEM, the key of
    another certificate, and a key with a pass phrase.
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
        raise _certificate_refusal(certificate, key, error) from error
    return context


def _check_readable(path: Path) -> None:
    try:
        path.read_bytes()
    except OSError as error:
        raise InvalidInput(
            f"{path} cannot be read: {error.strerror}",
            asked=str(path),
            found=error.strerror,
            remedy="give the path of a PEM file",
        ) from error


def _no_pass_phrase() -> str:
    raise InvalidInput(
        "the key has a pass phrase, which cannot be entered when a server starts unattended",
        found="a key with a pass phrase",
        remedy="give one without: openssl pkey -in KEY -out NEW",
    )


def _certificate_refusal(certificate: Path, key: Path, error: ssl.SSLError) -> InvalidInput:
    if error.reason == "KEY_VALUES_MISMATCH":
        found, remedy = (
            f"{key} is the key of another certificate",
            "give the key that the certificate was made with",
        )
    else:
        found, remedy = f"no certificate and key in PEM ({error.reason or error})", "give both as PEM files"
    return InvalidInput(
        f"cannot serve https by {certificate} and {key}: {found}",
        asked=f"{certificate} and {key}",
        found=found,
        remedy=remedy,
    )
