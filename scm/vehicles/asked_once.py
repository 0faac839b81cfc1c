"""What numba asks of its operators, asked once: a compiler's sum of two floats has one type.

As numba stands it tries all its rules again wherever an operator or a function of its own is used,
thousands of times for a kernel: a seventh of the time that compiling one takes.
"""

from typing import Any

from numba.core.targetconfig import ConfigStack
from numba.core.types.functions import BaseFunction

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


def remember_answers() -> None:
    """Let numba remember what each of its functions gives for types and flags, in this process."""
    _Function.get_call_type = _get_call_type
