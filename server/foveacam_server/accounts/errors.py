"""Errors of requests without the needed right."""

from foveacam_server.accounts.rights import Principal, Right
from foveacam_server.foundation.errors import Forbidden

_DOING = {
    Right.VIEW: "see this",
    Right.OPERATE: "operate the rig",
    Right.ADMINISTER: "administer this server",
}


def forbidden(principal: Principal, right: Right, *, asked: str) -> Forbidden:
    """Return the error of a request that lacks `right`."""
    return Forbidden(
        f"{asked} needs the right to {_DOING[right]}; you are {principal.title}",
        asked=asked,
        found=principal.title,
        remedy=f"ask an admin of this server for the right to {right.value}",
    )


def require(principal: Principal, right: Right, *, asked: str) -> None:
    """Raise `Forbidden` unless the principal has the right."""
    if not principal.may(right):
        raise forbidden(principal, right, asked=asked)
