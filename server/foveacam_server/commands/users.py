"""`foveacam users`: manages the users of a stopped server, also when nobody can sign in any more."""

import json
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console
from rich.table import Table

from foveacam_hardware.contract import Busy
from foveacam_server.accounts.rights import LOCAL, UserRole
from foveacam_server.commands.options import DataOption, JsonOption
from foveacam_server.foundation.settings import checked_settings

if TYPE_CHECKING:
    from foveacam_server.accounts.accounts import Accounts
    from foveacam_server.accounts.audit import AuditLog
    from foveacam_server.accounts.users import Invitation

app = typer.Typer(name="users", help="Who may use a server; for one that runs, use its page People.")

NameArgument = Annotated[str, typer.Argument(help="the user's name, lower case")]
_CREATED, _OK = 201, 200


@app.command("list")
def list_users(data: DataOption = None, as_json: JsonOption = False) -> None:
    """List the users."""
    with _accounts(data) as accounts:
        users = accounts.users.all()
    if as_json:
        documents = [{"name": user.name, "role": user.role.value, "state": user.state} for user in users]
        typer.echo(json.dumps({"users": documents}))
        return
    table = Table("name", "role", "state", "last seen")
    for user in users:
        table.add_row(user.name, user.role.value, user.state, user.last_seen_utc or "never")
    Console().print(table if users else "No users: everyone on this machine has all rights.")


@app.command()
def add(
    name: NameArgument,
    role: Annotated[UserRole, typer.Option(help="role of the user")] = UserRole.OPERATOR,
    data: DataOption = None,
) -> None:
    """Add a user; the first one is an admin. Prompts for the password."""
    password = typer.prompt("Password", hide_input=True, confirmation_prompt=True)
    with _accounts(data) as accounts:
        accounts.users.add(name, role, password=password)
        _audit(accounts.audit, "POST", "/api/v1/users", _CREATED, f"{name}, {role}, by the command line")
    typer.echo(f"{name} may sign in as {role}.")


@app.command()
def link(name: NameArgument, data: DataOption = None) -> None:
    """Print a one-time link by which a user sets a new password, for instance an admin who forgot it."""
    with _accounts(data) as accounts:
        invitation = accounts.users.invite(name)
        _audit(accounts.audit, "POST", f"/api/v1/users/{name}/invitation", _OK, "by the command line")
    typer.echo(_link_words(invitation))


@app.command()
def remove(
    name: NameArgument,
    keep_tokens: Annotated[
        bool, typer.Option("--keep-tokens", help="keep the user's tokens of services valid")
    ] = False,
    data: DataOption = None,
) -> None:
    """Remove a user, who is signed out everywhere; the user's tokens of services are listed, and revoked."""
    with _accounts(data) as accounts:
        tokens = accounts.remove_user(name, keep_tokens=keep_tokens)
        fate = "kept" if keep_tokens else "revoked"
        names = ", ".join(token.name for token in tokens)
        detail = f"by the command line; tokens {fate}: {names}" if tokens else "by the command line"
        _audit(accounts.audit, "DELETE", f"/api/v1/users/{name}", _OK, detail)
    typer.echo(f"{name} is removed.")
    for token in tokens:
        scopes = ", ".join(sorted(token.scopes))
        typer.echo(f"  {fate}: the token {token.name} ({token.prefix}…), which may {scopes}")


def _link_words(invitation: "Invitation") -> str:
    return (
        f"Start the server, then open this path of it until {invitation.expires_utc}:\n"
        f"  /join?code={invitation.code}"
    )


@contextmanager
def _accounts(data: object) -> "Iterator[Accounts]":
    from foveacam_server.accounts.accounts import Accounts
    from foveacam_server.foundation.store import Store

    folder = checked_settings({"data": data}).data
    try:
        store = Store(folder)
    except Busy as error:
        raise Busy(
            f"a server is using {folder}",
            asked=str(folder),
            found="a server that runs",
            remedy="use its page People, or stop it first",
        ) from error
    with store:
        accounts = Accounts(store)
        try:
            yield accounts
        finally:
            accounts.close()


def _audit(log: "AuditLog", method: str, path: str, status: int, detail: str) -> None:
    log.add(LOCAL, method=method, path=path, address="this machine", status=status, detail=detail)
