"""A short run: two cars, a junction that turns green, two events, picture, scan, plan, grids."""

import struct

import msgspec

from scm.clock import NS_PER_S
from scm.maps.load import load_map
from scm.recorder.mcap_file import RunFile
from scm.records.boxes import SnapshotBox
from scm.records.signals import SignalGroup
from scm.v2x.exchange import RawSample
from scm.v2x.grid_payload import packed
from scm.v2x.key import prefix
from scm.v2x.message import encode
from scm.v2x.messages.autonomy_plan import AutonomyPlan
from scm.v2x.messages.city_event import CityEvent
from scm.v2x.messages.costmap import Costmap
from scm.v2x.messages.occupancy_map import OccupancyMap
from scm.v2x.messages.spat import Spat
from scm.v2x.messages.vehicle_state import VehicleState
from scm.v2x.messages.world_definition import WorldDefinition
from scm.v2x.messages.world_snapshot import SnapshotVehicle, WorldSnapshot

BEGIN_NS = 1_700_000_000 * NS_PER_S
HZ = 20
GREEN_S = 2.0
STUCK_S = 4.0  # from when on n1 is stuck against n10
YAW_RAD = 0.5
PICTURE = b"\xff\xd8 a picture \xff\xd9"
RANGES_M = (1.0, 2.0, float("inf"), 0.5)  # ahead, left, a miss behind, right

WAY = ((0.0, 0.0, 0.0), (1.0, 0.0, YAW_RAD))
PLAN = AutonomyPlan(
    vehicle="n1", t_ns=BEGIN_NS, path=WAY, trajectory=WAY, particles=WAY, obstacles=((0.5, 0.2),),
    candidates=(WAY,),
)  # fmt: skip
ROOM = OccupancyMap(
    vehicle="n1", t_ns=BEGIN_NS, rows=2, columns=3, cell_m=0.05, x_m=-1.0, y_m=2.0, car_x_m=1.0,
    car_y_m=0.0, car_yaw_rad=YAW_RAD, state="map", path=WAY, compression="zlib",
    payload=packed(bytes((0, 100, 255, 0, 0, 100))),
)  # fmt: skip
COSTMAP = Costmap(
    vehicle="n1", t_ns=BEGIN_NS, rows=1, columns=3, cell_m=0.02, x_m=0.5, y_m=0.0, step_m=0.01,
    half_width_m=0.09, payload=packed(bytes((0, 9, 200))),
)  # fmt: skip


def write_run(
    path, seconds=5.0, *, finish=True, leaves_s=float("inf"), picture=PICTURE, of_n1=None,
    pause_s=0.0, flash_s=None,
):  # fmt: skip
    """Write the run, a chunk each quarter of a second; without `finish` as a kill leaves it.

    Within `flash_s` the junction flashes. From `leaves_s` on the world tells of n10 no more.
    `of_n1` holds pictures of its front camera by their times [s]. With `pause_s` nothing is
    recorded for so long after 2 s.
    """
    file = RunFile(path, "city")
    file.write(_sample(0.0, "world/def", _definition()))
    file.write(_sample(0.0, "event/info/world", _event("info", "n1 stands on the map")))
    for tick in range(round(seconds * HZ) + 1):
        at_s = tick / HZ + (pause_s if tick > 2 * HZ else 0.0)
        for name, x_m in (("n1", at_s), ("n10", -at_s)):
            file.write(_sample(at_s, f"v/{name}/state", _state(name, at_s, x_m, tick)))
        file.write(_sample(at_s, "world/snapshot", _snapshot(at_s, tick, leaves_s)))
        if tick % 2 == 0:
            file.write(_sample(at_s, "tl/crossing/spat", _spat(at_s, flash_s)))
        if tick == 3 * HZ:
            file.write(_sample(at_s, "event/warning/world", _event("warning", "n1 hit a wall")))
            file.write(_picture(at_s, "eye/overhead/frame", picture, camera="overhead"))
            file.write(_scan(at_s))
            file.write(_sample(at_s, "v/n1/autonomy/plan", PLAN))
            file.write(_bulk(at_s, "v/n1/map", ROOM))
            file.write(_bulk(at_s, "v/n1/costmap", COSTMAP))
        if of_n1 and at_s in of_n1:
            key = "v/n1/@camera/front"
            file.write(_picture(at_s, key, of_n1[at_s], vehicle="n1", camera="front"))
        if tick % 5 == 0:
            file.flush()
    file.flush()
    content = path.read_bytes()
    file.close()
    if not finish:
        path.write_bytes(content)
    return path


def _sample(at_s, key, message):
    t_ns = BEGIN_NS + round(at_s * NS_PER_S)
    return RawSample(prefix("city") + key, msgspec.json.encode(message), None, t_ns)


def _bulk(at_s, key, message):
    return RawSample(prefix("city") + key, *encode(message), BEGIN_NS + round(at_s * NS_PER_S))


def _picture(at_s, key, jpeg, **whose):
    head = {**whose, "t_ns": BEGIN_NS, "width_px": 4, "height_px": 3}
    t_ns = BEGIN_NS + round(at_s * NS_PER_S)
    return RawSample(prefix("city") + key, jpeg, msgspec.json.encode(head), t_ns)


def _scan(at_s):
    t_ns = BEGIN_NS + round(at_s * NS_PER_S)
    head = {"vehicle": "n1", "t_ns": t_ns, "beams": 4, "range_min_m": 0.15, "range_max_m": 12.0}
    ranges = struct.pack("<4f", *RANGES_M)
    return RawSample(prefix("city") + "v/n1/scan", ranges, msgspec.json.encode(head), t_ns)


def _definition():
    return WorldDefinition(t_ns=BEGIN_NS, seed=0, map=load_map("driving_school"))


def _event(severity, text):
    return CityEvent(
        severity=severity, source="world", t_ns=BEGIN_NS, name="told", text=text, vehicle="n1"
    )


def _state(name, at_s, x_m, tick):
    return VehicleState(
        vehicle=name,
        t_ns=BEGIN_NS + round(at_s * NS_PER_S),
        seq=tick,
        x_m=x_m,
        y_m=0.5,
        yaw_rad=0.0,
        speed_mps=1.0,
        yaw_rate_radps=0.0,
        steering_rad=0.1,
        throttle=0.4,
        steering=0.2,
        source="simulated",
    )


def _snapshot(at_s, tick, leaves_s):
    cars = tuple(
        SnapshotVehicle(
            vehicle=name,
            kind="hosted",
            car="nigel",
            tag_id=number,
            x_m=x_m,
            y_m=0.5,
            yaw_rad=YAW_RAD,
            speed_mps=1.0,
            steering_rad=0.1,
            stuck=("n10",) if name == "n1" and at_s >= STUCK_S else None,
        )
        for number, (name, x_m) in enumerate((("n1", at_s), ("n10", -at_s)))
        if name == "n1" or at_s < leaves_s
    )
    boxes = (SnapshotBox(name="box1", x_m=0.0 if at_s < 1.0 else 0.1, y_m=0.0, yaw_rad=0.0),)
    return WorldSnapshot(t_ns=BEGIN_NS, tick=tick, vehicles=cars, boxes=boxes)


def _spat(at_s, flash_s):
    colour = "red" if at_s < GREEN_S else "green"
    group = SignalGroup(group="south_east", colour=colour, since_ns=0, min_end_ns=0)
    mode = "flash" if flash_s and flash_s[0] <= at_s < flash_s[1] else "plan"
    t_ns = BEGIN_NS + round(at_s * NS_PER_S)
    return Spat(junction="crossing", t_ns=t_ns, seq=1, mode=mode, plan="calm", groups=(group,))
