"""A ROS 2 node on Zenoh, without ROS: its session, publishers and subscriptions.

By default it opens its own router, which ROS nodes connect to as to `rmw_zenohd`; so they cannot
reach the city's keys or its router. Or it joins a running `rmw_zenohd`. As in `scm.v2x.bus_zenoh`,
callbacks only queue the bytes.
"""

import json
import logging
import threading
from collections import deque
from types import TracebackType
from typing import Any, NamedTuple, Protocol, Self

import zenoh
from zenoh import ext

from scm.errors import AccessError, LinkError, MessageError, RunError
from scm.log import event
from scm.ros2 import names, types
from scm.v2x import zenoh_config
from scm.v2x.access import is_local
from scm.v2x.yielding import yielding

DEFAULT_LISTEN = "tcp/127.0.0.1:7448"
MAX_RECEIVED = 1000
HEARTBEAT_S = 0.5
CONNECT_S = 5.0

_log = logging.getLogger(__name__)


class Received(NamedTuple):
    """A message that a ROS node published."""

    topic: str
    message: Any


class Endpoint(Protocol):
    """A publisher or a subscription that can be ended."""

    def close(self) -> None:
        """Leave the ROS graph; once."""
        ...


class Topic(Endpoint, Protocol):
    """A publisher of one topic."""

    @property
    def is_wanted(self) -> bool:
        """Whether any node subscribes to it now."""
        ...

    def publish(self, message: Any, t_ns: int) -> None:
        """Send a message; `t_ns` is when it was made."""
        ...


class Graph(Protocol):
    """What the part needs of ROS: `Wire`, or a fake in a test."""

    def publisher(self, topic: str, kind: str, *, latched: bool = False) -> Topic:
        """Return a new publisher; a latched one keeps its last message for late joiners."""
        ...

    def subscribe(self, topic: str, kind: str) -> Endpoint:
        """Let messages of a topic come out of `received`."""
        ...

    def received(self) -> list[Received]:
        """Return what arrived since the last time, in order."""
        ...


class Wire:
    """The node `scm` of a ROS domain; a context manager that leaves the graph at its end.

    Args:
        endpoint: Where to listen, or the address of the router that ROS nodes connect to.
        domain: ROS_DOMAIN_ID.
        listen: Whether to be that router.
        node: The node's name.

    Raises:
        AccessError: when other computers could reach the endpoint.
        RunError: when it cannot listen at the endpoint, or rosbags is missing.
        LinkError: when there is no router to connect to.
    """

    def __init__(
        self, endpoint: str, domain: int = 0, *, listen: bool = True, node: str = "scm"
    ) -> None:
        types.store()
        if listen and not is_local(endpoint):
            msg = (
                f"ROS: got {endpoint!r} to listen at, where everybody on the network could drive "
                "cars; expected tcp/127.0.0.1:PORT, or to connect to an rmw_zenohd of yours"
            )
            raise AccessError(msg)
        self._lock = threading.Lock()
        self._received: deque[tuple[str, str, bytes]] = deque(maxlen=MAX_RECEIVED)
        self._endpoints: list[_End] = []
        self._made = 0
        self._closed = False
        self.rejected = 0
        self._session = _listening(endpoint) if listen else _connected(endpoint)
        self._node = names.Node(domain, str(self._session.info.zid()), node)
        self._token = self._session.liveliness().declare_token(self._node.token)

    def publisher(self, topic: str, kind: str, *, latched: bool = False) -> "_Publisher":
        """Return a new publisher; a latched one keeps its last message for late joiners."""
        quality = names.qos(latched=latched, depth=1 if latched else names.DEFAULT_DEPTH)
        key, token = self._names(topic, kind, "MP", quality)
        declare = _declare_latched if latched else _declare
        publisher = _Publisher(self._session, token, declare(self._session, key), kind)
        self._endpoints.append(publisher)
        return publisher

    def subscribe(self, topic: str, kind: str) -> "_End":
        """Let messages of a topic come out of `received`, the newest thousand of all topics."""
        key, token = self._names(topic, kind, "MS", names.qos())

        def note(sample: zenoh.Sample) -> None:
            if sample.kind == zenoh.SampleKind.PUT:
                with self._lock:
                    self._received.append((topic, kind, sample.payload.to_bytes()))

        direct: Any = zenoh.handlers.Callback(note, indirect=False)
        subscription = _End(self._session, token, self._session.declare_subscriber(key, direct))
        self._endpoints.append(subscription)
        return subscription

    def received(self) -> list[Received]:
        """Return what arrived since the last time, in order; what cannot be read is dropped."""
        with self._lock:
            raw = list(self._received)
            self._received.clear()
        out = []
        for topic, kind, body in raw:
            try:
                out.append(Received(topic, types.from_cdr(kind, body)))
            except MessageError as cause:
                self.rejected += 1
                event(_log, "ros_message_rejected", level=logging.WARNING, topic=topic, why=cause)
        return out

    def _names(self, topic: str, kind: str, what: str, qos: str) -> tuple[str, str]:
        self._made += 1
        chunks = names.type_chunks(kind, types.hash_of(kind))
        key = names.topic_key(self._node.domain, topic, chunks)
        return key, self._node.endpoint_token(self._made, what, topic, chunks, qos)

    def close(self) -> None:
        """Leave; safe to call twice."""
        for endpoint in self._endpoints:
            endpoint.close()
        if not self._closed:
            self._closed = True
            self._token.undeclare()  # type: ignore[no-untyped-call]
            self._session.close()  # type: ignore[no-untyped-call]

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()


class _End:
    """One endpoint: its Zenoh declaration and its token in the ROS graph."""

    def __init__(self, session: zenoh.Session, token: str, declared: Any) -> None:
        self._declared = declared
        self._token = session.liveliness().declare_token(token)
        self._closed = False

    def close(self) -> None:
        """Leave the ROS graph; safe to call twice."""
        if not self._closed:
            self._closed = True
            self._token.undeclare()  # type: ignore[no-untyped-call]
            self._declared.undeclare()


class _Publisher(_End):
    def __init__(self, session: zenoh.Session, token: str, declared: Any, kind: str) -> None:
        super().__init__(session, token, declared)
        self._kind = kind
        self._gid = names.gid_of(token)
        self._sent = 0

    @property
    def is_wanted(self) -> bool:
        """Whether any node subscribes to it now."""
        return bool(self._declared.matching_status.matching)

    def publish(self, message: Any, t_ns: int) -> None:
        """Send a message; never waits for a slow receiver."""
        self._sent += 1
        beside = names.attachment(self._sent, t_ns, self._gid)
        self._declared.put(types.to_cdr(self._kind, message), attachment=beside)


def _declare(session: zenoh.Session, key: str) -> zenoh.Publisher:
    return session.declare_publisher(key, congestion_control=zenoh.CongestionControl.DROP)


def _declare_latched(session: zenoh.Session, key: str) -> Any:
    """Return a publisher that keeps one message, as rmw_zenoh's TRANSIENT_LOCAL does."""
    # The type stubs require both arguments.
    facts: dict[str, Any] = {"sporadic_heartbeat": HEARTBEAT_S}
    return ext.declare_advanced_publisher(
        session,
        key,
        cache=ext.CacheConfig(1),
        sample_miss_detection=ext.MissDetectionConfig(**facts),
        publisher_detection=True,
        congestion_control=zenoh.CongestionControl.DROP,
    )


def _listening(endpoint: str) -> zenoh.Session:
    """Return a router with gossip, by which ROS nodes, which are peers, find each other."""
    config = json.loads(zenoh_config.router([endpoint]))
    config["scouting"] |= {"gossip": {"enabled": True}}
    try:
        with yielding():
            return zenoh.open(zenoh.Config.from_json5(json.dumps(config)))
    except zenoh.ZError as cause:
        why = zenoh_config.reason(cause)
        msg = f"cannot listen for ROS at {endpoint!r}: does another router run there? ({why})"
        raise RunError(msg) from cause


def _connected(endpoint: str) -> zenoh.Session:
    try:
        with yielding():
            return zenoh.open(zenoh.Config.from_json5(zenoh_config.client(endpoint, CONNECT_S)))
    except zenoh.ZError as cause:
        why = zenoh_config.reason(cause)
        msg = (
            f"no router for ROS at {endpoint!r} within {CONNECT_S} s: does rmw_zenohd run? ({why})"
        )
        raise LinkError(msg) from cause
