"""The answers of a running server to commands, read as schemas."""

from typing import TypeVar

from pydantic import TypeAdapter, ValidationError

from foveacam_hardware.contract import FoveaError

T = TypeVar("T")


def read_answer(schema: TypeAdapter[T], answer: object) -> T:
    """Return a server's answer as its schema; raise `FoveaError` for another."""
    try:
        return schema.validate_python(answer)
    except ValidationError as error:
        raise FoveaError(
            f"the server's answer is not as it was expected ({error.errors()[0]['msg']}); is it of another"
            " version?"
        ) from error
