"""A city from another program, over its web interface: `Client("http://127.0.0.1:8000")`.

`connection.py` sends requests, `stream.py` receives live events; `client.py`, `nouns/` and
`records/` are written by `python docs/make/client.py` from the interface's own description.
"""

from scm.client.client import Client
from scm.client.connection import ProblemError

__all__ = ["Client", "ProblemError"]
