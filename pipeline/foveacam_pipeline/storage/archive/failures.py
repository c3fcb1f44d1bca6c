"""Translation of errors of S3-compatible storage into the contract's errors."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from foveacam_hardware.contract import FoveaError, InvalidInput, NotConnected

GO_ON = "the same request goes on where it stopped"


@dataclass(frozen=True, slots=True, kw_only=True)
class _Known:
    """A known failure, recognised by the storage's error codes or by exception names."""

    codes: frozenset[str]
    found: str
    remedy: str


_KNOWN = (
    _Known(
        codes=frozenset({"NoSuchBucket"}),
        found="there is no such bucket",
        remedy="create it, or give the right s3://bucket/prefix",
    ),
    _Known(
        codes=frozenset(
            {
                "PermanentRedirect",
                "301",
                "AuthorizationHeaderMalformed",
                "IllegalLocationConstraintException",
                "IncorrectEndpoint",
            }
        ),
        found="the bucket is in another region",
        remedy="set AWS_DEFAULT_REGION to the bucket's region",
    ),
    _Known(
        codes=frozenset({"NoCredentialsError", "PartialCredentialsError", "ProfileNotFound"}),
        found="there are no credentials for it",
        remedy="set AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY, or AWS_PROFILE",
    ),
    _Known(
        codes=frozenset(
            {
                "AccessDenied",
                "403",
                "Forbidden",
                "InvalidAccessKeyId",
                "SignatureDoesNotMatch",
                "ExpiredToken",
                "PermissionError",
            }
        ),
        found="the storage refuses these credentials",
        remedy="let them list, read and write there, or choose others (AWS_PROFILE)",
    ),
    _Known(
        codes=frozenset({"NoSuchKey", "404", "FileNotFoundError"}),
        found="it is not in the archive",
        remedy="see `foveacam archive list` for what is there, or archive it again from a copy",
    ),
)


@contextmanager
def archive_errors(asked: str, url: str, failures: tuple[type[Exception], ...]) -> Iterator[None]:
    """Turn one of `failures` raised inside into an error of the contract; `asked`: what was to be done."""
    try:
        yield
    except failures as error:
        raise _archive_error(error, asked=asked, url=url) from error


def _archive_error(error: Exception, *, asked: str, url: str) -> FoveaError:
    marks = set(_marks(error))
    for known in _KNOWN:
        if known.codes & marks:
            return InvalidInput(
                f"{asked} in {url}: {known.found}",
                asked=asked,
                found=known.found,
                remedy=known.remedy,
            )
    words = " ".join(str(error).split()) or type(error).__name__
    found = f"the storage does not answer ({words})"
    return NotConnected(
        f"{asked} in {url}: {found}",
        asked=asked,
        found=found,
        remedy=f"check the network and FOVEACAM_ARCHIVE_ENDPOINT; {GO_ON}",
    )


def _marks(error: BaseException | None) -> Iterator[str]:
    """Yield the class names of an error and of its causes, and the codes that the storage gave."""
    while error is not None:
        yield type(error).__name__
        response = getattr(error, "response", None)
        if isinstance(response, dict):
            yield str(response.get("Error", {}).get("Code"))
        error = error.__cause__ or error.__context__
