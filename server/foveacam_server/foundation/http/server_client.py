"""REST client of a running server for the command line; its refusals become errors with its own words."""

from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

from pydantic import SecretStr

from foveacam_hardware.contract import Busy, FoveaError, InvalidInput, NotConnected
from foveacam_server.foundation.errors import NotFound
from foveacam_server.foundation.http.addresses import join_address, server_address
from foveacam_server.foundation.schema import RequestModel

if TYPE_CHECKING:
    import httpx

PATIENCE_S = 90.0
_REFUSALS: dict[int, type[FoveaError]] = {404: NotFound, 409: Busy, 422: InvalidInput}


class ServerClient:
    """Asks the server at `address`, such as http://127.0.0.1:8000, also below a path of a site.

    Raise `InvalidInput` for what is no address. Every call may raise it for what was refused as wrong,
    `NotConnected` where nobody answers, `Busy` and `NotFound` as the server says it, else `FoveaError`.
    """

    def __init__(self, address: str, *, token: SecretStr | None) -> None:
        import httpx  # here, since commands that ask no server need not load it

        self.address = server_address(address)
        headers = {} if token is None else {"X-Api-Token": token.get_secret_value()}
        self._base = join_address(self.address, "/api/v1")
        self._http = httpx.Client(headers=headers, timeout=PATIENCE_S, trust_env=False)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._http.close()

    def get(self, path: str, **query: str) -> Any:  # noqa: ANN401 - any JSON document
        """Return the document at `path`, which begins with a slash."""
        return self._content("GET", path, params=query)

    def post(self, path: str, body: RequestModel | None = None, *, wait_s: int = 0) -> Any:  # noqa: ANN401 - JSON, as above
        """Send an order; `wait_s`: how long the server may keep the answer back until the work is done."""
        headers = {"Prefer": f"wait={wait_s}"} if wait_s else {}
        document = None if body is None else body.as_json()
        return self._content("POST", path, json=document, headers=headers)

    def _content(self, method: str, path: str, **more: Any) -> Any:  # noqa: ANN401 - httpx's own, and as above
        import httpx

        try:
            answer = self._http.request(method, join_address(self._base, path), **more)
            document = answer.json()
        except (httpx.InvalidURL, httpx.UnsupportedProtocol, ValueError) as error:
            raise self._no_address(error) from error
        except httpx.HTTPError as error:
            raise NotConnected(
                f"server {self.address}: it was not reached ({error}); start it, or leave --server out"
            ) from error
        if answer.is_success:
            return document
        raise self._refused(answer, document)

    def _refused(self, answer: "httpx.Response", document: object) -> FoveaError:
        detail = document.get("detail") if isinstance(document, dict) else None
        if not isinstance(detail, str):
            return self._no_address(f"it answered {answer.status_code}")
        return _REFUSALS.get(answer.status_code, FoveaError)(detail)

    def _no_address(self, why: object) -> InvalidInput:
        return InvalidInput(
            f"--server {self.address}: no server of ours answers there ({why}); give its address, such as"
            " http://127.0.0.1:8000"
        )
