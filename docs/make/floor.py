"""Makes the pictures of docs/floor.md: the proving ground, a ride over it, a push of a box.

Run with `python docs/make/floor.py`; needs `pip install -e '.[docs]'`.
"""

from pathlib import Path

import numpy as np
from drawing import plt

from scm.geometry import Pose2
from scm.maps.draw import draw_svg
from scm.maps.load import load_map
from scm.records.city_map import Box, CityMap, MapTag
from scm.records.floor import Floor, Plate, Ramp
from scm.vehicles.car import load_car
from scm.vehicles.fleet import Fleet
from scm.vehicles.ground import Ground
from scm.world.contact_space import STEP_S
from scm.world.contacts import Contacts
from scm.world.solids import Hull

PICTURES = Path(__file__).parents[1] / "pictures"
BLUE, ORANGE, GREY = "#2563c9", "#d9822b", "#8a919c"
HULL = Hull(2.4, 0.0229, -0.14, 0.16, -0.0875, 0.0875, restitution=0.2, friction=0.5)


def city(boxes: tuple[Box, ...] = (), **floor: object) -> CityMap:
    """Return a map with a floor and boxes of our own."""
    whole = Floor(x_m=(-5.0, 5.0), y_m=(-5.0, 5.0), **floor)
    tag = MapTag(tag_id=0, size_m=0.1)
    return CityMap(map=1, name="n", title="", source="", floor=whole, tag=tag, boxes=boxes)


def ride() -> np.ndarray:
    """Drive a Nigel over a mat, up a ramp, along a deck and off its end."""
    ground = Ground(
        city(
            plates=(
                Plate(name="mat", x_m=0.75, y_m=0.0, length_m=0.5, width_m=1.0, height_m=0.004),
                Plate(name="deck", x_m=2.3, y_m=0.0, length_m=0.6, width_m=1.0, height_m=0.03),
            ),
            ramps=(Ramp(name="up", x_m=1.75, y_m=0.0, length_m=0.5, width_m=1.0, to_m=0.03),),
        )
    )
    fleet = Fleet(load_car("nigel"), 1)
    fleet.add(Pose2(0.0, 0.0, 0.0), 0.25)
    fleet.throttle[0] = 1.0
    rows = []
    while fleet.x[0] < 3.0:
        ground.feel(fleet, 0)
        fleet.advance(STEP_S)
        front, rear = (float(fleet.wheel_load[0, wheel]) for wheel in (0, 2))
        state = (fleet.x[0] + 0.14154, fleet.floor_height[0, 0], fleet.z[0], fleet.speed[0])
        rows.append((*map(float, state), front, rear))
    return np.array(rows)


def draw_ride() -> None:
    """Draw what the ride did."""
    x, floor, _, speed, front, rear = ride().T
    figure, (heights, loads, speeds) = plt.subplots(3, 1, figsize=(8, 6), sharex=True)
    heights.plot(x, 1e3 * floor, color=BLUE)
    heights.set_ylabel("floor under the\nfront wheel [mm]")
    loads.plot(x, front, color=BLUE, label="front left")
    loads.plot(x, rear, color=ORANGE, label="rear left")
    loads.set_ylabel("wheel load [N]")
    loads.set_ylim(0.0, 20.0)
    loads.legend(frameon=False, loc="upper left")
    speeds.plot(x, speed, color=BLUE)
    speeds.set_ylabel("speed [m/s]")
    speeds.set_xlabel(
        "front axle along the way [m]: mat at 0.5 to 1, ramp at 1.5, deck at 2 to 2.6"
    )
    save(figure, "floor_ride.png")


def push(force: float) -> tuple[np.ndarray, np.ndarray]:
    """Press a car on ice against a box with a force; return the box's way and the car's speed."""
    box = Box(name="b", x_m=0.2625, y_m=0.0, length_m=0.2, width_m=0.2, mass_kg=0.5, friction=0.5)
    contacts, motion = Contacts(city((box,))), np.zeros((1, 6))
    contacts.add(0, HULL)
    rows = []
    for _ in range(300):
        motion[:, 3] += force / HULL.mass * STEP_S
        motion[:, :3] += STEP_S * motion[:, 3:]
        touches = contacts.step(np.zeros(1, np.int64), motion)
        motion[:, 3:] += touches.dv
        motion[:, :2] += touches.shift
        rows.append((contacts.boxes.motion[0, 0] - box.x_m, motion[0, 3]))
    way, speed = np.array(rows).T
    return way, speed


def draw_push() -> None:
    """Draw how far a box goes under three pushes."""
    figure, axes = plt.subplots(figsize=(8, 3.2))
    times = STEP_S * np.arange(1, 301)
    for force, colour in ((2.0, GREY), (3.0, ORANGE), (4.0, BLUE)):
        axes.plot(times, 1e3 * push(force)[0], color=colour, label=f"pushed with {force:g} N")
    axes.set_xlabel("time [s]")
    axes.set_ylabel("way of the box [mm]")
    axes.set_title("A box of 0.5 kg, friction 0.5: the floor holds it against 2.45 N", fontsize=10)
    axes.legend(frameon=False)
    save(figure, "floor_box.png")


def save(figure: plt.Figure, name: str) -> None:
    """Write a picture."""
    for axes in figure.axes:
        axes.spines[["top", "right"]].set_visible(False)
        axes.grid(color="#e6e8ec")
    figure.tight_layout()
    figure.savefig(PICTURES / name, dpi=110)


if __name__ == "__main__":
    drawn = draw_svg(load_map("proving_ground"))
    (PICTURES / "proving_ground.svg").write_text(drawn, encoding="utf-8")
    draw_ride()
    draw_push()
