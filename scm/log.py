"""One way to log: an event name and key=value pairs whose keys end in their unit."""

import logging


def event(logger: logging.Logger, name: str, *, level: int = logging.INFO, **facts: object) -> None:
    """Log `name key=value ...` at the given level."""
    if logger.isEnabledFor(level):
        logger.log(level, "%s %s", name, " ".join(f"{k}={v}" for k, v in facts.items()))
