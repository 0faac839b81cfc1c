"""Boxes that can be pushed, as the overhead camera sees them."""

import numpy as np

from scm.eye.camera import camera_model
from scm.eye.sources.synthetic import SyntheticSource
from scm.maps.load import load_map
from scm.records.boxes import SnapshotBox
from scm.v2x.messages.world_snapshot import WorldSnapshot

CITY = load_map("proving_ground")


def picture(source, *boxes):
    return source.render(WorldSnapshot(t_ns=1, tick=1, vehicles=(), boxes=boxes)).astype(int)


def test_a_box_is_seen_where_it_was_pushed_and_no_longer_where_it_was():
    model = camera_model(CITY.cameras[0])
    source = SyntheticSource(CITY, model, np.random.default_rng(0))
    box = CITY.boxes[0]
    others = [SnapshotBox(name=b.name, x_m=b.x_m, y_m=b.y_m, yaw_rad=b.yaw_rad)
              for b in CITY.boxes[1:2]]  # fmt: skip
    before = picture(source).copy()
    after = picture(source, SnapshotBox(name=box.name, x_m=1.0, y_m=1.0, yaw_rad=0.0), *others)
    changed = np.abs(after - before).sum(axis=2) > 60
    for x, y in ((box.x_m, box.y_m), (1.0, 1.0)):
        ((u, v),) = model.project(np.array([[x, y, box.height_m]]))
        assert changed[int(v) - 8 : int(v) + 8, int(u) - 8 : int(u) + 8].mean() > 0.9
    u, v = model.project(np.array([[2.0, 1.35, 0.0]]))[0]
    assert changed[int(v) - 20 : int(v) + 20, int(u) - 20 : int(u) + 20].mean() < 0.01
