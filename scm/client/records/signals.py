"""Records of signals.

Written by docs/make/client.py: do not change it here.
"""

import msgspec


class StageBody(msgspec.Struct, kw_only=True, frozen=True):
    """One stage of the cycle; yellow and red clear after it are the kernel's.

    Attributes:
        groups: that are green together
        green_s: how long they are green
        extra_red_s: all red on top of red clear
    """

    groups: tuple[str, ...]
    green_s: float
    extra_red_s: float = 0.0
