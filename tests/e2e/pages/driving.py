"""A car that is driven by hand on its page."""

from tests.e2e.city_process import wait_for

CAR = "n1"


def row(running, name=CAR):
    """Return what the city knows of a car."""
    return running.get(f"/vehicles/{name}")


def take(visited, running, name=CAR):
    """Take a car over on its open page, and wait until it stands under the wheel."""
    page = visited.page
    page.click("text=Take over")
    page.wait_for_selector('.wheel[data-state="held"]')

    def stands():
        car = row(running, name)
        return car["lease_left_ms"] is not None and abs(car["speed_mps"]) < 0.01

    visited.until(stands, "it stands under the wheel")


def send_on(running, name=CAR):
    """Give a car a route; one that a wheel left beside the lanes begins anew."""
    answer = running.web.post(f"/vehicles/{name}/route", json={})
    if answer.status_code == 422:
        running.web.delete(f"/vehicles/{name}").raise_for_status()
        running.web.post("/vehicles", json={"vehicle": name}).raise_for_status()
        answer = running.web.post(f"/vehicles/{name}/route", json={})
    assert answer.is_success or answer.status_code == 404, answer.text  # it has left just now


def drives_by_itself(running, name=CAR):
    """Wait until its own driver has a car again."""

    def drives():
        car = row(running, name)
        return car["lease_left_ms"] is None and car["mode"] == "drive" and car["trip"]

    wait_for(drives, 60.0, f"{name} drives by itself again")
