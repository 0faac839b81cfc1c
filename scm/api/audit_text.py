"""Entries of the audit log in words: what somebody requested, in plain language.

A request on the bus is put into words by its class, a call of the interface by the summary of its
route: a new route has words from the start, and a test looks whether every class has.
"""

from collections.abc import Callable, Iterable, Mapping
from typing import Any

from fastapi import APIRouter
from fastapi.routing import APIRoute
from starlette.routing import Match

from scm.api.idempotency import CHANGES
from scm.store.audit import UNREADABLE

Facts = Mapping[str, Any]

_LEASES = {"acquire": "take", "release": "give back", "steal": "take from its owner"}


def _spaced(name: object) -> str:
    return str(name).replace("_", " ")


def _names(names: Iterable[str]) -> str:
    return ", ".join(_spaced(name) for name in names)


def _plan(request: Facts) -> str:
    plan = request["plan"]
    what = {"flash": "flash red", "": "end the flashing"}.get(plan, f"run {_spaced(plan)}")
    return f"{what} at {_spaced(request['junction'])}"


def _signal(request: Facts) -> str:
    verb, at = request["verb"], _spaced(request["junction"])
    groups, policy = _names(request.get("groups", ())), _spaced(request.get("policy", ""))
    if verb == "clear":
        words = ["withdraw", _spaced(request.get("clears", "") or "requests"), groups]
        return f"{' '.join(filter(None, words))} at {at}"
    lasts_s = request.get("expires_s", 60.0)
    words = [_spaced(verb), policy, groups]
    return f"{' '.join(filter(None, words))} at {at} for {lasts_s:g} s"


def _route(request: Facts) -> str:
    via = _names(request.get("via", ()))
    return f"send {request['vehicle']} {f'through {via}' if via else 'on its way'}"


def _spawn(request: Facts) -> str:
    return f"add {request.get('vehicle') or 'a car'}, a {_spaced(request.get('car', 'nigel'))}"


def _join(request: Facts) -> str:
    kind, car = request.get("kind", "remote"), _spaced(request.get("car", "nigel"))
    return f"join as {request['vehicle']}, a {kind} {car}"


def _calibration(request: Facts) -> str:
    camera = _spaced(request["camera"])
    if request.get("verb") == "back":
        return f"put the calibration before this one in force at {camera}"
    named = _spaced(request.get("calibration", ""))
    return f"put calibration {named} in force at {camera}" if named else f"calibrate {camera}"


def _version(request: Facts) -> str:
    number = request["version"]
    named = f"version {number} of its file" if number else "the file that it came with"
    return f"predict {request['vehicle']} by {named}"


def _bay(request: Facts) -> str:
    return f"give {request['vehicle']} {request.get('bay') or 'any bay'}"


_REQUESTS: dict[str, Callable[[Facts], str]] = {
    "BayRequest": _bay,
    "BoxesRequest": lambda _: "put the boxes back to their places",
    "CalibrationRequest": _calibration,
    "JoinRequest": _join,
    "LeaseRequest": lambda request: f"{_LEASES[request['verb']]} the wheel of {request['vehicle']}",
    "LightRequest": lambda request: f"set the lights of {request['vehicle']}",
    "MonitorReset": lambda request: f"reset the monitor of {_spaced(request['junction'])}",
    "ParkRequest": lambda request: f"park {request['vehicle']} at {request['goal']}",
    "PlanRequest": _plan,
    "RemoveRequest": lambda request: f"take {request['vehicle']} off the map",
    "RouteRequest": _route,
    "SignalRequest": _signal,
    "SpawnRequest": _spawn,
    "StopRequest": lambda request: (
        "stop the city" if request["engaged"] else "release the city stop"
    ),
    "TwinSendRequest": lambda request: (
        f"send {request['send']} to decide whose {request['vehicle']}'s change is"
    ),
    "VersionRequest": _version,
}


class AuditText:
    """Puts an entry of the audit log into words.

    Args:
        nouns: The routers of the interface, by the prefix that they stand below.
    """

    def __init__(self, nouns: Mapping[str, Iterable[APIRouter]]) -> None:
        self._routes = [
            (prefix, route)
            for prefix, routers in nouns.items()
            for router in routers
            for route in router.routes
            if isinstance(route, APIRoute) and CHANGES.intersection(route.methods or ())
        ]

    def of(self, kind: str, request: Facts) -> str:
        """Return an entry in words.

        One that is not as it was written, by an older city or by somebody who changed it, is called
        by its kind.

        Args:
            kind: Class of a request on the bus, or method and path of a call of the interface.
            request: The request as it was logged.
        """
        if kind == UNREADABLE:
            return "what stands here is no entry: somebody changed it"
        method, _, path = kind.partition(" ")
        if method in CHANGES:
            return self._call(method, path)
        try:
            return _REQUESTS[kind](request)
        except (KeyError, TypeError, ValueError):
            return _spaced(kind)

    def _call(self, method: str, path: str) -> str:
        scope = {"type": "http", "method": method, "headers": []}
        for prefix, route in self._routes:
            if not path.startswith(prefix):
                continue
            scope["path"] = path.removeprefix(prefix)
            match, found = route.matches(scope)
            if match is Match.FULL:
                named = _names(str(value) for value in found["path_params"].values())
                summary = str(route.summary)
                return summary[:1].lower() + summary[1:] + (f" ({named})" if named else "")
        return f"request an unknown address, {method} {path}"
