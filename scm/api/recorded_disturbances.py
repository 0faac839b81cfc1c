"""What made measurements void while a run was recorded, as far as its messages show."""

from scm.api.replay import read
from scm.clock import NS_PER_S
from scm.disturbances import MESSAGE_KINDS, Disturbances
from scm.recorder.mcap_file import SchemaTable
from scm.recorder.run_index import RunIndex
from scm.records.disturbances import Disturbance, RecordedDisturbance, RecordedDisturbances
from scm.v2x.exchange import Incoming


def disturbances_of(index: RunIndex) -> RecordedDisturbances:
    """Watch a run for disturbances as the server does a city.

    Raises:
        RecordingError: when the file cannot be opened any more.
    """
    watch, schemas = Disturbances(), SchemaTable(index.city)
    kinds = {
        key: kind
        for key in index.topics.values()
        if (kind := schemas.kind_of(key)) is not None and kind in MESSAGE_KINDS
    }
    for one in index.read(0, index.end_ns, kinds.__contains__):
        message = read(one, kinds[one.key])
        if message is not None:
            watch.receive(Incoming(message, one.t_ns))
    watch.check_silence(index.end_ns)
    return RecordedDisturbances(
        disturbances=tuple(_since_begin(one, index) for one in watch.recent(index.begin_ns)),
        void=watch.void_reasons(index.begin_ns, index.end_ns),
    )


def _since_begin(one: Disturbance, index: RunIndex) -> RecordedDisturbance:
    last_ns = index.end_ns if one.end_ns is None else one.end_ns
    start_s, end_s = (
        round(max(0, min(t_ns, index.end_ns) - index.begin_ns) / NS_PER_S, 3)
        for t_ns in (one.start_ns, last_ns)
    )
    return RecordedDisturbance(
        kind=one.kind, source=one.source, text=one.text, start_s=start_s, end_s=end_s
    )
