"""A device that answers as rosserial's library does, without any time of its own."""

from vehicle_agent.nigel.rosserial import (
    FLOAT32,
    FLOAT32_MD5,
    PUBLISHER_INFO,
    REQUEST_TOPICS,
    SUBSCRIBER_INFO,
    TIME,
    Decoder,
    Frame,
    TopicInfo,
    pack,
    pack_topic_info,
    unpack_float,
)
from vehicle_agent.nigel.telemetry import FLOATS, FLOATS_MD5

STEER = TopicInfo(100, "steer_cmd", FLOAT32, FLOAT32_MD5, 280)
DRIVE = TopicInfo(101, "drive_cmd", FLOAT32, FLOAT32_MD5, 280)
LIGHT = TopicInfo(102, "light_cmd", FLOAT32, FLOAT32_MD5, 280)
TELEMETRY = TopicInfo(125, "telemetry", FLOATS, FLOATS_MD5, 280)
BATTERY = TopicInfo(126, "battery_v", FLOAT32, FLOAT32_MD5, 280)

NANO = (STEER, DRIVE)
OURS = (STEER, DRIVE, LIGHT, TELEMETRY, BATTERY)


def announced(info):
    """Return the frame that tells of a topic."""
    kind = PUBLISHER_INFO if info.number >= 125 else SUBSCRIBER_INFO
    return pack(Frame(kind, pack_topic_info(info)))


def asking_time():
    return pack(Frame(TIME, bytes(8)))


class Device:
    """What the host's frames do to it.

    Attributes:
        said: Every frame that came.
        values: The newest value of each topic, by name.
    """

    def __init__(self, topics=NANO):
        self.topics = topics
        self._decoder = Decoder()
        self.said = []
        self.values = {}

    def hear(self, data, now_ns):
        """Take the host's bytes; return the answer."""
        answer = b""
        names = {info.number: info.name for info in self.topics}
        for frame in self._decoder.feed(data, now_ns):
            self.said.append(frame)
            if frame == REQUEST_TOPICS:
                answer += asking_time() + b"".join(map(announced, self.topics))
            elif frame.topic in names:
                self.values[names[frame.topic]] = unpack_float(frame.payload)
        return answer
