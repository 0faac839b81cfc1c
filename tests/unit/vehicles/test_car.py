import pytest

from scm.errors import CarError
from scm.vehicles.car import car_names, load_car
from scm.vehicles.car_files import TYPES_DIR

NIGEL = (TYPES_DIR / "nigel.toml").read_text(encoding="utf-8")


def changed(tmp_path, *changes):
    """Write Nigel's file with some of its text replaced; return its path."""
    text = NIGEL
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    path = tmp_path / "mine.toml"
    path.write_text(text, encoding="utf-8")
    return path


def refusal(path):
    with pytest.raises(CarError) as error:
        load_car(path)
    return str(error.value)


def test_values_come_with_spread_unit_and_source():
    mass = load_car("nigel").quantity("body.mass_kg")
    assert (mass.value, mass.std, mass.unit, mass.source) == (2.4, 0.15, "kg", "ours")


def test_sensor_sections_stay_readable():
    car = load_car("nigel")
    assert car.vector("lidar.range_m") == (0.15, 12.0)
    assert car.value("encoder.counts_per_revolution") == 1920.0
    assert car.text("ips.tag_family") == "tag36h11"
    assert len(car.vector("drive.throttle_speed_m_s")) == 10


def test_a_reader_that_asks_for_the_wrong_kind_is_told(tmp_path):
    car = load_car("nigel")
    with pytest.raises(CarError, match=r"lidar\.range_m: expected one number"):
        car.value("lidar.range_m")
    with pytest.raises(CarError, match=r"lidar\.rate: not in this car .*lidar\.rate_hz"):
        car.value("lidar.rate")


def test_a_car_given_by_path_is_the_car_given_by_name():
    by_name, by_path = load_car("nigel"), load_car(TYPES_DIR / "nigel.toml")
    assert by_path == by_name


def test_a_file_without_terms_gets_the_standard_ones(tmp_path):
    start, end = NIGEL.index("terms = ["), NIGEL.index("[body]")
    path = tmp_path / "plain.toml"
    path.write_text(NIGEL[:start] + NIGEL[end:], encoding="utf-8")
    assert load_car(path).terms == load_car("nigel").terms


def test_an_unknown_car_is_refused_with_the_nearest_name():
    with pytest.raises(CarError, match=r"nigle: no such car; .* mean 'nigel'"):
        load_car("nigle")
    with pytest.raises(CarError, match=r"here/nigle\.toml: no such file; .* mean 'nigel'"):
        load_car("here/nigle.toml")


def test_a_misspelt_key_is_refused_with_file_key_and_nearest_name(tmp_path):
    said = refusal(changed(tmp_path, ("wheelbase_m ", "wheelbse_m ")))
    assert "mine.toml: body.wheelbse_m: no such key (did you mean 'body.wheelbase_m'?)" in said
    assert "body.wheelbase_m: missing; expected front axle to rear axle [m]" in said


def test_an_unknown_key_that_is_like_no_other_gets_no_suggestion(tmp_path):
    said = refusal(changed(tmp_path, ("[drive] ", "[drive]\nmotor_curent = 3\n# ")))
    assert "drive.motor_curent: no such key\n" in said + "\n"


def test_a_key_in_the_wrong_section_is_told_the_right_one(tmp_path):
    said = refusal(changed(tmp_path, ("[body]", "[body]\nstall_torque_nm = 3")))
    assert "body.stall_torque_nm: no such key (did you mean 'drive.stall_torque_nm'?)" in said


def test_a_misspelt_field_is_refused_with_the_nearest_name(tmp_path):
    said = refusal(changed(tmp_path, ("value = 2.40, ", "vaule = 2.40, ")))
    assert "body.mass_kg: no such field 'vaule' (did you mean 'value'?)" in said


def test_all_problems_are_told_at_once(tmp_path):
    said = refusal(
        changed(
            tmp_path,
            ("value = 2.40,", "value = -1,"),
            ('value = "rear"', 'value = "both"'),
            ("[lidar]", "[lidra]"),
            ('"servo", ', '"srevo", '),
            ("value = [0.15, 12.0]", "value = [0.15]"),
            ("value = 7.0,", 'value = "fast",'),
        )
    ).splitlines()
    assert any("body.mass_kg: expected 0.2 to 5000 kg, got -1" in line for line in said)
    assert any("drive.layout: expected 'rear' or 'front' or 'all', got 'both'" in x for x in said)
    assert any("[lidra]: no such section (did you mean 'lidar'?)" in line for line in said)
    assert any("terms: no effect 'srevo' (did you mean 'servo'?)" in line for line in said)
    assert all("mine.toml: " in line for line in said)


def test_a_vector_of_the_wrong_length_is_refused(tmp_path):
    said = refusal(changed(tmp_path, ("value = [0.15, 12.0]", "value = [0.15]")))
    assert "lidar.range_m: expected 2 numbers [m], got 1" in said


@pytest.mark.parametrize("bad", ['"fast"', "true", "[1.0]", "nan"])
def test_a_wrong_type_is_refused(tmp_path, bad):
    said = refusal(changed(tmp_path, ("value = 7.0,", f"value = {bad},")))
    assert "lidar.rate_hz: expected" in said


def test_a_bare_number_is_refused_with_the_form_expected(tmp_path):
    bare = 'mass_kg               = { value = 2.40,    std = 0.15,  source = "ours" }'
    said = refusal(changed(tmp_path, (bare, "mass_kg = 2.4")))
    assert "body.mass_kg: expected { value = ..., source = ... }, got 2.4" in said


def test_a_wrong_unit_is_refused(tmp_path):
    said = refusal(changed(tmp_path, ("value = 2.40, ", 'value = 2.40, unit = "g", ')))
    assert "body.mass_kg.unit: expected 'kg', got 'g'" in said


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("value = 0.07077", "value = 0.2"), "cog_to_rear_axle_m: expected less than"),
        (("value = 0.045, ", "value = 0.7, "), "outweigh body.mass_kg = 2.4"),
        (("front_driven              = { value = 0", "front_driven = { value = 1"), "contradicts"),
        (
            (
                "[suspension] ",
                '[com_shift]\nshift_m = { value = 0.08, source = "x" }\n[suspension] ',
            ),
            "com_shift.shift_m: 0.08 puts the centre of gravity outside the axles",
        ),
        (
            (
                "[suspension] ",
                '[load_transfer]\nheight_m = { value = -0.06, source = "x" }\n[suspension] ',
            ),
            "load_transfer.height_m: -0.06 puts the centre of gravity below the floor",
        ),
        (
            (
                "lateral_slip_asymptote    = { value = 0.50",
                "lateral_slip_asymptote = { value = 0.15",
            ),
            "tyre.lateral_slip_asymptote: expected above the extremum at 0.2, got 0.15",
        ),
        (('"servo", ', '"servo", "servo", '), "terms: 'servo' is listed twice"),
        (("terms = [", "terms = [3,"), "terms: expected a list of effect names"),
        (('"tyre_contact", ', ""), "no term sets load"),
        (('name = "nigel"', 'name = "my car"'), "name: expected up to 40 letters, digits"),
        (('scale = "1:14"', "scale = 14"), "scale: expected text, got 14"),
        (("std = 0.15, ", 'std = "much", '), "body.mass_kg.std: expected a number"),
        (("std = 0.15, ", "sigma = 0.15, "), "body.mass_kg: no such field"),
    ],
)
def test_contradictions_are_refused(tmp_path, change, said):
    assert said in refusal(changed(tmp_path, change))


def test_a_file_that_is_not_toml_is_refused(tmp_path):
    path = tmp_path / "broken.toml"
    path.write_text("name = [", encoding="utf-8")
    assert "broken.toml: not a TOML file" in refusal(path)


def test_front_wheel_drive_follows_from_the_layout(tmp_path):
    path = changed(
        tmp_path,
        ('value = "rear"', 'value = "front"'),
        ("front_driven              = { value = 0", "front_driven = { value = 1"),
    )
    car = load_car(path)
    assert (car.value("drive.front_driven"), car.value("drive.rear_driven")) == (1.0, 0.0)


@pytest.fixture
def garage(tmp_path, monkeypatch):
    """Return a folder whose car files have names."""
    monkeypatch.setenv("SCM_CARS", str(tmp_path))
    return tmp_path


def test_a_car_of_ones_own_folder_has_a_name(garage):
    shipped = car_names()
    (garage / "buggy.toml").write_text((TYPES_DIR / "nigel.toml").read_text())
    assert car_names() == sorted([*shipped, "buggy"])
    assert load_car("buggy").path == garage / "buggy.toml"
    assert load_car("nigel").path == TYPES_DIR / "nigel.toml"


def test_cars_beside_the_usual_recordings_have_names_where_no_folder_is_named(
    tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("SCM_CARS")
    shipped = car_names()
    folder = tmp_path / "runs" / "cars"
    folder.mkdir(parents=True)
    (folder / "buggy.toml").write_text((TYPES_DIR / "nigel.toml").read_text())
    assert car_names() == sorted([*shipped, "buggy"])
    monkeypatch.setenv("SCM_CARS", "")
    assert car_names() == shipped
    with pytest.raises(CarError, match="cars of your own: SCM_CARS=FOLDER of their files"):
        load_car("buggy")


def test_a_shipped_cars_name_is_not_given_twice(garage):
    (garage / "nigel.toml").write_text("")
    with pytest.raises(CarError, match="'nigel' is a shipped car's name"):
        load_car("nigel")


def test_a_folder_that_is_not_there_is_refused(garage, monkeypatch):
    monkeypatch.setenv("SCM_CARS", str(garage / "none"))
    with pytest.raises(CarError, match="expected a folder of car files"):
        car_names()
