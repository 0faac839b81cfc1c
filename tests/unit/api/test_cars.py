"""Car files over REST: which there are, and new ones from a few figures."""

import pytest

from scm.api.routes import cars
from scm.errors import CarError
from scm.vehicles.car import car_names, load_car

BUGGY = {"car": "lab_buggy", "scale": "1:10", "mass_kg": 3.2, "wheelbase_m": 0.324,
         "motor": "direct", "top_speed_mps": 6.0}  # fmt: skip


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("SCM_CARS", str(tmp_path))
    return tmp_path


def test_shipped_cars_are_listed_with_their_outline_and_what_lanes_they_miss(client):
    listed = client("GET", "/api/v1/cars").json()
    by_name = {car["car"]: car for car in listed["cars"]}
    assert list(by_name) == sorted(car_names())
    assert listed["folder"] == ""
    nigel, f1tenth = by_name["nigel"], by_name["f1tenth"]
    assert (nigel["rear_m"], nigel["front_m"], nigel["shipped"]) == (-0.07, 0.23, True)
    assert nigel["misfit"] == ""
    assert nigel["turning_radius_m"] == pytest.approx(0.2452, abs=1e-4)
    assert "wider than 4 lanes" in f1tenth["misfit"]


def test_a_preview_writes_nothing(client, folder):
    made = client("GET", "/api/v1/cars/preview", params=BUGGY).json()
    assert made["text"].startswith("# Made from a few figures")
    assert made["wheelbase_m"] == 0.324
    assert "lane" in made["misfit"]
    assert not list(folder.iterdir())


def test_a_new_car_is_there_at_once_and_its_file_comes_back(client, folder):
    reply = client("POST", "/api/v1/cars", json=BUGGY)
    assert reply.status_code == 201
    assert reply.headers["location"] == "/api/v1/cars/lab_buggy"
    assert [path.name for path in folder.iterdir()] == ["lab_buggy.toml"]
    assert load_car("lab_buggy").value("body.mass_kg") == 3.2
    assert "lab_buggy" in [car["car"] for car in client("GET", "/api/v1/cars").json()["cars"]]
    assert client("GET", "/api/v1/cars/lab_buggy").json()["text"] == reply.json()["text"]
    loaded = client("GET", "/api/v1/cars/lab_buggy.toml")
    assert loaded.headers["content-disposition"] == 'attachment; filename="lab_buggy.toml"'
    assert loaded.text == reply.json()["text"]


def test_a_car_file_is_never_written_over(client, folder):
    (folder / "lab_buggy.toml").write_text("# mine\n", encoding="utf-8")
    for body in (BUGGY, {**BUGGY, "car": "nigel"}, {**BUGGY, "car": "preview"}):
        reply = client("POST", "/api/v1/cars", json=body)
        assert reply.status_code == 409
        assert f"named '{body['car']}' already" in reply.json()["detail"]
    assert (folder / "lab_buggy.toml").read_text(encoding="utf-8") == "# mine\n"


def test_of_two_who_make_a_car_at_once_the_first_stays(client, folder, monkeypatch):
    monkeypatch.setattr(cars, "car_files", dict)  # the other file came after this was looked at
    (folder / "lab_buggy.toml").write_text("# mine\n", encoding="utf-8")
    assert client("POST", "/api/v1/cars", json=BUGGY).status_code == 409
    assert (folder / "lab_buggy.toml").read_text(encoding="utf-8") == "# mine\n"
    assert [path.name for path in folder.iterdir()] == ["lab_buggy.toml"]


def test_a_broken_file_of_ones_own_is_listed_with_what_is_wrong(client, folder):
    (folder / "odd.toml").write_text("[body]\nmass_kg = 2\n", encoding="utf-8")
    (odd,) = [car for car in client("GET", "/api/v1/cars").json()["cars"] if car["car"] == "odd"]
    assert "body.mass_kg: expected { value = ..., source = ... }, got 2" in odd["problem"]
    assert str(folder) not in odd["problem"], "no paths of the server"


def test_without_a_folder_it_is_said_how_to_name_one(client, monkeypatch):
    monkeypatch.setenv("SCM_CARS", "")
    reply = client("POST", "/api/v1/cars", json=BUGGY)
    assert reply.status_code == 409
    assert "SCM_CARS=FOLDER" in reply.json()["detail"]


@pytest.mark.parametrize(
    ("change", "where"),
    [
        ({"car": "../x"}, "car"),
        ({"mass_kg": -1}, "mass_kg"),
        ({"wheelbase_m": 40.0}, "wheelbase_m"),
        ({"motor": "steam"}, "motor"),
        ({"colour": "red"}, "colour"),
    ],
)
def test_wrong_figures_are_refused_by_name(client, folder, change, where):
    reply = client("GET", "/api/v1/cars/preview", params={**BUGGY, **change})
    assert reply.status_code == 422
    assert where in reply.text
    assert not list(folder.iterdir())


def test_sizes_that_fit_no_car_name_the_number(client, folder):
    reply = client("GET", "/api/v1/cars/preview", params={**BUGGY, "track_m": 0.01})
    assert reply.status_code == 422
    assert "body.track_m: expected 0.03 to 3 m" in reply.json()["detail"]


def test_an_unknown_one_is_not_found(client):
    assert client("GET", "/api/v1/cars/nobody").status_code == 404
    with pytest.raises(CarError):
        load_car("nobody")
