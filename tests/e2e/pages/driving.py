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


def drives_by_itself(running, name=CAR):
    """Wait until its own driver has a car again."""

    def drives():
        car = row(running, name)
        return car["lease_left_ms"] is None and car["mode"] == "drive" and car["trip"]

    wait_for(drives, 60.0, f"{name} drives by itself again")
