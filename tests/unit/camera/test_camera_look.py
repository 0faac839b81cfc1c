"""What lens and sensor make of a picture: softness, dark corners, colour, tone, motion."""

import dataclasses
import math

import msgspec
import numpy as np
import pytest
from numpy.testing import assert_allclose

from scm.camera.look import Look
from scm.camera.motion import STILL, along
from scm.camera.optics import fitted
from scm.camera.tween import motion
from scm.geometry import Pose2
from scm.v2x.messages.world_snapshot import WorldSnapshot
from scm.vehicles.car import load_car, varied_cars

SMALL = {"width_px": 320, "height_px": 180, "focal_px": 265.0}


def grey(level):
    return np.full((180, 320, 3), level, np.uint8)


def test_defaults_leave_a_frame_as_it_is(optics):
    frame = grey(77)
    assert Look(optics(**SMALL)).apply(frame) is frame
    assert (frame == 77).all()


def test_vignetting_is_the_share_of_light_missing_at_the_corners(optics):
    shown = Look(optics(**SMALL, vignetting=0.4)).apply(grey(200)).astype(int)
    assert shown[90, 160, 1] == pytest.approx(200, abs=1)
    assert shown[0, 0, 1] == pytest.approx(120, abs=2)
    assert shown[90, 0, 1] == pytest.approx(200 * (1 - 0.4 * 320**2 / (320**2 + 180**2)), abs=2)


def test_white_balance_is_red_green_blue_and_gamma_bends_the_tone_curve(optics):
    shown = Look(optics(**SMALL, white_balance=(1.5, 1.0, 0.5), gamma=2.0)).apply(grey(128))
    blue, green, red = shown[0, 0]
    assert (red, green, blue) == (145, 64, 16)  # 255 (share 128 / 255)^2
    assert Look(optics(**SMALL, white_balance=(1.5, 1.0, 1.0))).apply(grey(200))[0, 0, 2] == 255


def test_blur_spreads_an_edge_by_its_standard_deviation(optics):
    frame = grey(0)
    frame[:, 160:] = 255
    shown = Look(optics(**SMALL, blur_px=2.0)).apply(frame)[90, :, 0].astype(float)
    slope = np.diff(shown)
    middle = np.arange(len(slope)) @ slope / slope.sum()
    spread = math.sqrt((np.arange(len(slope)) - middle) ** 2 @ slope / slope.sum())
    assert spread == pytest.approx(2.0, abs=0.2)


def test_noise_comes_after_the_tone_curve(studio, optics, car):
    me = car(0.3, 0.3)
    dark = {**SMALL, "exposure": 0.01, "gamma": 5.0}
    black = studio.picture(optics(**dark), me, [me], {}, "front", 0)
    assert black.max() == 0
    noisy = studio.picture(optics(**dark, read_noise=4.0), me, [me], {}, "front", 0)
    assert np.sqrt((noisy.astype(float) ** 2).mean()) == pytest.approx(4.0 / math.sqrt(2), rel=0.05)


@pytest.mark.parametrize(("yaw", "roll"), [(0.1, 0.0), (0.0, 0.1)])
def test_mounting_turns_the_camera_to_the_left_and_clockwise(optics, car, yaw, roll):
    from scm.camera.lens import Lens

    lens = Lens(optics(yaw=yaw, roll=roll, pitch_down=0.0, position=(0.0, 0.0, 0.1)))
    ahead, left = np.array([[1.0, 0.0, 0.1]]), np.array([[1.0, 0.2, 0.1]])
    view = lens.view(np.eye(3), np.zeros(3))
    at, beside = (lens.project(view.seen(point))[0] for point in (ahead, left))
    f = lens.matrix[0, 0]
    assert at[0] - 639.5 == pytest.approx(f * math.tan(yaw), abs=1e-6)
    # A camera turned clockwise shows what is level turned counter-clockwise: lower at its left.
    assert beside[1] - at[1] == pytest.approx(0.2 * f * math.sin(roll), abs=1e-6)


def test_a_share_of_a_motion_is_an_arc():
    whole = along(along(Pose2(0.2, 0.05, 0.5), 0.25), 4.0)
    assert_allclose(whole, (0.2, 0.05, 0.5), atol=1e-12)
    half = along(Pose2(0.2, 0.05, 0.5), 0.5)
    assert_allclose(half @ half, (0.2, 0.05, 0.5), atol=1e-12)
    assert_allclose(along(Pose2(0.2, 0.0, 0.0), -0.5), (-0.1, 0.0, 0.0))


# Straight on, hardly more than the floor's grain moves, which warps soften.
@pytest.mark.parametrize(("turn_rad", "left"), [(0.0, 0.5), (0.06, 0.35)])
def test_motion_blur_is_the_mean_of_pictures_along_the_motion(studio, optics, car, turn_rad, left):
    lens = optics(width_px=640, height_px=360, focal_px=530.0)
    moved = Pose2(0.03, 0.0, turn_rad)
    me = car(0.3, 0.3)

    def seen_after(share):
        at = Pose2(0.3, 0.3, 0.0) @ along(moved, share)
        other = msgspec.structs.replace(me, x_m=at.x, y_m=at.y, yaw_rad=at.yaw)
        return studio.picture(lens, other, [other], {}, "front", 0).astype(float)

    mean = np.mean([seen_after((k + 0.5) / 16 - 0.5) for k in range(16)], axis=0)
    blurred = studio.picture(lens, me, [me], {}, "front", 0, motion=moved).astype(float)
    sharp = studio.picture(lens, me, [me], {}, "front", 0).astype(float)
    floor = slice(180, None)
    off = np.abs(blurred - mean)[floor].mean()
    assert off < left * np.abs(sharp - mean)[floor].mean()
    still = studio.picture(lens, me, [me], {}, "front", 0, motion=STILL)
    assert (still == sharp).all()


def test_a_cars_motion_is_that_between_two_snapshots(car):
    def at(t_ns, *pose):
        return WorldSnapshot(t_ns=t_ns, tick=0, vehicles=(car(*pose),))

    before = at(0, 1.0, 1.0, math.pi / 2)
    assert_allclose(
        motion(before, at(50_000_000, 1.0, 1.01, math.pi / 2), "n1", 0.01), (0.002, 0, 0), atol=1e-9
    )
    assert motion(before, at(50_000_000, 2.0, 1.0, 0.0), "n1", 0.01) == STILL  # put elsewhere
    assert motion(before, at(50_000_000, 1.0, 1.01), "n2", 0.01) == STILL  # not there


def test_cameras_of_a_varied_car_are_those_of_its_numbers():
    usual = fitted("nigel")["front"]
    varied = load_car("nigel").with_values(
        {"camera.exposure": 0.5, "camera.white_balance": (1.1, 1.0, 0.9), "camera.roll_rad": 0.02}
    )
    with varied_cars({"nigel": varied}):
        found = fitted("nigel")["front"]
    assert found == dataclasses.replace(
        usual, exposure=0.5, white_balance=(1.1, 1.0, 0.9), roll=0.02
    )
    assert fitted("nigel")["front"] == usual


def test_a_car_varied_twice_is_what_it_was_before():
    dim = load_car("nigel").with_values({"camera.exposure": 0.5})
    with varied_cars({"nigel": dim}):
        with varied_cars({"nigel": dim.with_values({"camera.gain": 2.0})}):
            assert (fitted("nigel")["front"].exposure, fitted("nigel")["front"].gain) == (0.5, 2.0)
        assert (fitted("nigel")["front"].exposure, fitted("nigel")["front"].gain) == (0.5, 1.0)
    assert fitted("nigel")["front"].exposure == 1.0
