"""What numba asks of its operators, asked once: a compiler's sum of two floats has one type.

As numba stands it tries all its rules again wherever an operator or a function of its own is used,
thousands of times for a kernel: a seventh of the time that compiling one takes. A tenth of what is
left goes for asking as often whether there are new rules and how its own functions are called, and
for telling nobody that LLVM is entered and left.
"""

from collections.abc import Callable
from functools import cache
from typing import Any, cast

from llvmlite.binding import ffi
from numba.core import base
from numba.core.base import BaseContext
from numba.core.targetconfig import ConfigStack
from numba.core.types.functions import BaseFunction
from numba.core.typing.context import BaseContext as TypingContext

_Asked = dict[tuple[int, Any], tuple[Any, Any]]

_Function: Any = BaseFunction
_Flags: Any = ConfigStack
_resolve = _Function.get_call_type
_under_flags: list[tuple[dict[str, Any], _Asked]] = []


def _asked() -> _Asked:
    """Return what was asked under the flags of the function that is being compiled."""
    flags = _Flags.top_or_none()
    values = {} if flags is None else flags._values  # noqa: SLF001 comparing all options is slow
    for known, asked in _under_flags:
        if known == values:
            return asked
    _under_flags.append((dict(values), {}))
    return _under_flags[-1][1]


def _get_call_type(function: Any, context: Any, args: Any, kws: Any) -> Any:
    """Return the signature of a call of a function of numba's for types; failures are not kept."""
    if kws:
        return _resolve(function, context, args, kws)
    asked, question = _asked(), (id(function), args)
    if question not in asked:
        signature = _resolve(function, context, args, kws)
        asked[question] = function, signature  # the function too: its number stays its own
    return asked[question][1]


def _rules(context: Any) -> int:
    """Return how many rules stand in the registries that a context has read from."""
    loaders = context._registries.items()  # noqa: SLF001
    return sum(len(getattr(r, name)) for r, loader in loaders for name in loader.registry_items)


def _if_new(refresh: Callable[[Any], None], count: Callable[[Any], int]) -> Callable[[Any], None]:
    """Return a refresh that does nothing while no rule has come: none ever goes."""

    def refresh_if_new(context: Any) -> None:
        known = vars(context).setdefault("_known_rules", [0])
        if known[0] != count(context) or not known[0]:
            refresh(context)
            known[0] = count(context)

    return refresh_if_new


def remember_answers() -> None:
    """Let numba remember what each of its functions gives for types and flags, in this process."""
    _Function.get_call_type = _get_call_type
    numba: Any = base
    numba._has_loc = cache(numba._has_loc)  # noqa: SLF001
    typing, target = cast("Any", TypingContext), cast("Any", BaseContext)
    target.refresh = _if_new(target.refresh, lambda own: _rules(own) + _rules(own.typing_context))
    typing.refresh = _if_new(typing.refresh, _rules)
    llvm: Any = ffi.lib
    llvm._lock._cblist.clear()  # noqa: SLF001 those that tell of each entry into LLVM
