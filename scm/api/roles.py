"""Roles of those who call the interface: each may do what the one before may, and more.

A viewer looks. An operator runs the city: cars, routes, plans, the stop. An engineer also clears
faults that the monitor latched, and calibrates cameras. An admin also sees and ends keys. Every
route names its least role.
"""

from collections.abc import Callable
from typing import Annotated, get_args

from fastapi import Depends, Security
from fastapi.openapi.models import HTTPBearer
from fastapi.params import Security as Dependency
from fastapi.security.base import SecurityBase
from starlette.exceptions import HTTPException
from starlette.requests import HTTPConnection

from scm.errors import AccessError, nearest
from scm.records.keys import Role

SCHEME = "key"
"""What the description of the interface calls an API key."""

ROLES: tuple[Role, ...] = get_args(Role)


def check_role(name: str) -> Role:
    """Return the role of that name.

    Raises:
        AccessError: when there is none.
    """
    for role in ROLES:
        if role == name:
            return role
    msg = f"role: got {name!r}, expected one of {ROLES}{nearest(name, ROLES)}"
    raise AccessError(msg)


class AtLeast(SecurityBase):
    """A dependency of a route: the caller's role, from the gate, is this one or above."""

    model = HTTPBearer(
        description="An API key (`scm key add`), where the city requires one; see docs/security.md."
    )
    scheme_name = SCHEME

    def __init__(self, role: Role) -> None:
        self.role = role

    async def __call__(self, connection: HTTPConnection) -> None:
        """Pass, or refuse; in the event loop, so that busy threads delay no caller."""
        own: Role | None = connection.scope.get("scm_role")
        if own is None or ROLES.index(own) < ROLES.index(self.role):
            detail = f"your key is one of a {own}; this needs {self.role} or above"
            raise HTTPException(403, detail)


def _at_least(role: Role) -> Dependency:
    dependency: Dependency = Security(AtLeast(role), scopes=[role])
    return dependency


VIEWER = _at_least("viewer")
OPERATOR = _at_least("operator")
ENGINEER = _at_least("engineer")
ADMIN = _at_least("admin")


async def _signer(connection: HTTPConnection) -> Callable[[str], str]:
    scope = connection.scope
    owner = str(scope["scm_owner"]) if scope["scm_key"] else ""
    return lambda named: owner or named.strip() or str(scope["scm_actor"])


Signer = Annotated[Callable[[str], str], Depends(_signer)]
"""Who signs a request, by its body's `by`: with keys the key's owner, whatever `by` is; else
whom it names, or the program that calls."""
