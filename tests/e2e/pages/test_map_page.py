"""The map page as people use it: mouse, keyboard and table, and what it does to the real city."""

import itertools

import pytest

from scm.maps.load import load_map
from scm.maps.route import Roads
from tests.e2e.pages.visiting import LOOKS, SIZES, in_both_themes, photograph

SCENE = "/static/js/pages/map/scene.js"
FLEET = "/static/js/pages/map/fleet.js"
SELECTION = "/static/js/shared/selection.js"
SCALE = ".scale"


def fleet(visited, expression):
    """Evaluate JavaScript over the page's own fleet."""
    return visited.page.evaluate(
        f"async () => {{ const {{ fleet }} = await import('{FLEET}'); return {expression}; }}"
    )


def pixels_of(page, colour, reach=40):
    """Count the canvas' pixels of about a colour."""
    return page.evaluate(
        """([[r, g, b], reach]) => {
            const { width, height } = document.querySelector('.map canvas');
            const paper = document.querySelector('.map canvas').getContext('2d');
            const { data } = paper.getImageData(0, 0, width, height);
            let count = 0;
            for (let i = 0; i < data.length; i += 4)
                count += Math.abs(data[i] - r) + Math.abs(data[i + 1] - g)
                    + Math.abs(data[i + 2] - b) < reach;
            return count;
        }""",
        [colour, reach],
    )


def is_drawn(page, colour, least, most=10**9):
    """Wait until the canvas shows enough of a colour, and not too much."""
    for _ in range(300):
        if least <= pixels_of(page, colour) <= most:
            return
        page.wait_for_timeout(50)
    count = pixels_of(page, colour)
    raise AssertionError(f"{count} pixels of {colour}, expected {least} to {most}")


def ages_of(page):
    """Read the table's ages, row by row."""
    return page.locator(".cars tbody .age").all_inner_texts()


@pytest.mark.parametrize(("size", "theme"), LOOKS)
def test_the_map_looks_right(look, size, theme):
    visited = look(
        "/map?vehicle=n1", "map", size, theme, ready='.chosen-car dd:text-matches("m/s")'
    )
    for _ in in_both_themes(visited, theme):
        is_drawn(visited.page, (76, 141, 240), 100)  # hosted cars' blue
        is_drawn(visited.page, (90, 209, 255), 100)  # the way ahead of the chosen car


def test_the_binary_stream_tells_what_rest_tells(visit, running):
    visited = visit("/map")
    visited.page.wait_for_selector('tr[data-car="n6"]')
    told = {car["vehicle"]: car for car in running.get("/vehicles")["vehicles"]}
    shown = fleet(visited, "fleet.vehicles.map((car, row) => [car, fleet.x[row], fleet.y[row]])")
    assert [car["vehicle"] for car, _, _ in shown] == sorted(told)
    for car, x_m, y_m in shown:
        assert car["kind"] == told[car["vehicle"]]["kind"]
        assert abs(x_m - told[car["vehicle"]]["x_m"]) < 1.0
        assert abs(y_m - told[car["vehicle"]]["y_m"]) < 1.0
    before = fleet(visited, "fleet.sequence")
    visited.wait(
        f"""async (before) => (await import('{FLEET}')).fleet.sequence > before + 5""", before
    )


def test_the_map_is_zoomed_and_panned_by_mouse_and_keyboard(visit):
    visited = visit("/map")
    page = visited.page
    page.wait_for_selector(SCALE)
    whole = page.inner_text(SCALE)
    assert page.is_disabled('[aria-label="Show all"]')
    page.focus(".sheet")
    for _ in range(6):
        page.keyboard.press("+")
    visited.wait("(old) => document.querySelector('.scale').innerText !== old", whole)
    page.keyboard.press("0")
    visited.wait("(old) => document.querySelector('.scale').innerText === old", whole)
    box = page.locator(".sheet").bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    for _ in range(5):
        page.mouse.wheel(0, -300)
    visited.wait("(old) => document.querySelector('.scale').innerText !== old", whole)
    page.mouse.down()
    page.mouse.move(x - 200, y, steps=4)
    page.mouse.up()
    assert page.locator(".chosen-car").count() == 0  # a drag chooses nobody
    page.click('[aria-label="Show all"]')
    assert page.inner_text(SCALE) == whole
    assert visited.complaints == []


def pixel_of(page, x_m, y_m):
    """Return where the page shows a place of the whole map."""
    box = page.locator(".sheet").bounding_box()
    left, top, width, height = (-0.376, -1.665, 3.52, 2.19)
    scale = min(box["width"] / width, box["height"] / height)
    x = box["width"] / 2 + scale * (x_m - left - width / 2)
    y = box["height"] / 2 - scale * (y_m + top + height / 2)
    return box["x"] + x, box["y"] + y


def click_on(page, x_m, y_m):
    """Click on a place of the whole map."""
    page.mouse.click(*pixel_of(page, x_m, y_m))
    page.wait_for_timeout(100)


def test_a_car_is_chosen_on_the_map_followed_and_let_go(visit):
    visited = visit("/map")
    page = visited.page
    page.wait_for_selector('tr[data-car="n6"]')
    place = f"""async () => {{
        const {{ fleet }} = await import('{FLEET}');
        const row = fleet.rows.get('n5');
        return [fleet.x[row], fleet.y[row]];
    }}"""
    page.focus(".sheet")

    def click_on_it():
        click_on(page, *page.evaluate(place))
        return page.locator('tr[data-car="n5"].chosen').count()

    visited.until(click_on_it, "n5 is chosen by a click on it")
    page.focus(".sheet")
    page.keyboard.press("f")
    page.wait_for_selector('.chip:has-text("Following n5")')
    page.keyboard.press("ArrowLeft")  # who moves the map follows no more
    page.wait_for_selector(".chip", state="detached")
    page.keyboard.press("Escape")
    page.wait_for_selector(".chosen-car", state="detached")


def test_the_chosen_car_is_sent_to_a_lane_by_a_click_on_it_or_by_its_name(visit):
    visited = visit("/map?vehicle=n5")
    page = visited.page
    page.wait_for_selector('tr[data-car="n5"].chosen')
    roads = Roads(load_map("driving_school"))

    def is_offered():
        for lane, share in itertools.product(("west_loop", "east_loop"), (0.3, 0.5, 0.7)):
            at = roads.lane(lane).at(share * roads.length_of(lane))
            click_on(page, at.x, at.y)
            if page.locator(f'.chip:text-is("Send n5 to {lane}")').count():
                return lane
            page.click('tr[data-car="n5"]')  # a car stood there and was chosen
        return None

    lane = visited.until(is_offered, "a click on a lane offers it")
    page.click(f'.chip:text-is("Send n5 to {lane}")')
    page.wait_for_selector('.notice:has-text("n5 drives to ")')
    page.wait_for_selector(".chip", state="detached")
    click_on(page, 1.384, 1.3)  # between the loops: no lane
    page.wait_for_selector(".chosen-car", state="detached")
    page.click('tr[data-car="n5"]')
    page.click('.chosen-car button:text-is("Send to…")')
    page.fill('dialog [name="lane"]', "nowhere")
    page.click('dialog button:text-is("Send it")')
    page.wait_for_selector('.notice:has-text("no lane")')


def test_the_lidar_is_heard_only_while_it_is_shown(visit):
    page = visit("/map?vehicle=n2").page
    asked, ended = [], []
    page.on("request", lambda request: asked.append(request.url))
    page.on("requestfailed", lambda request: ended.append(request.url))
    page.click('.acts button:text("LIDAR")')
    is_drawn(page, (255, 210, 60), 150)
    assert [url for url in asked if "/vehicles/n2/scan/stream" in url]
    page.click('.acts button:text("LIDAR")')
    for _ in range(100):
        if any("scan/stream" in url for url in ended):
            break
        page.wait_for_timeout(50)
    assert any("scan/stream" in url for url in ended)
    is_drawn(page, (255, 210, 60), 0, most=149)


def test_layers_are_chosen_and_kept_for_the_next_visit(visit):
    visited = visit("/map")
    page = visited.page
    page.click('button:text("Layers")')
    page.check("input[name=heat]")
    page.check("input[name=trails]")
    page.wait_for_selector('.heat-key:has-text("m/s")')
    page.keyboard.press("Escape")
    page.wait_for_selector("#layers-list", state="hidden")
    page.reload()
    page.wait_for_selector(".heat-key")
    assert visited.complaints == []


def test_names_of_lanes_junctions_and_places_are_a_layer(visit):
    visited = visit("/map")
    page = visited.page
    names = f"async () => (await import('{SCENE}')).drawn.road_names"
    visited.wait(f"async () => (await import('{SCENE}')).drawn.frames > 0")
    assert page.evaluate(names) == 0  # off until one chooses it
    page.click('button:text("Layers")')
    page.check("input[name=roads]")
    page.keyboard.press("Escape")
    page.reload()  # kept for this browser
    # A junction, its four lanes and ten spawn places; where two would cover each other, one waits.
    visited.until(lambda: 11 <= page.evaluate(names) <= 15, "names are drawn")
    photograph(visited, "map_names_wide_light")
    width, height = SIZES["narrow"]
    page.set_viewport_size({"width": width, "height": height})
    page.emulate_media(color_scheme="dark")
    visited.until(lambda: 3 <= page.evaluate(names) < 11, "a small map shows what has room")
    photograph(visited, "map_names_narrow_dark")
    page.focus(".sheet")

    def is_close():
        page.keyboard.press("+")
        return page.evaluate(names) < 3

    visited.until(is_close, "only names that are in sight are drawn")
    assert visited.complaints == []


def test_the_table_is_searched_filtered_sorted_and_walked_by_keyboard(visit):
    visited = visit("/map")
    page = visited.page
    names = ".cars tbody tr[data-car] .name"
    page.wait_for_selector('tr[data-car="n6"]')
    for _ in range(3):  # the rows live while nobody touches them
        told = ages_of(page)
        visited.until(lambda told=told: ages_of(page) != told, "ages go on")
    page.select_option(".filters select", "remote")
    visited.until(lambda: page.locator(names).all_inner_texts() == ["n5", "n6"], "only agents")
    page.select_option(".filters select", "")
    page.fill(".filters input", "n3")
    visited.until(lambda: page.locator(names).all_inner_texts() == ["n3"], "only n3")
    page.fill(".filters input", "nobody")
    page.wait_for_selector('.cars .empty:text("No vehicle is like that.")')
    page.fill(".filters input", "")
    page.click('th button:has-text("Name")')
    page.wait_for_selector('th[aria-sort="descending"]')
    visited.until(lambda: page.locator(names).first.inner_text() == "n6", "n6 is first")
    page.focus(".cars .scroll")
    page.keyboard.press("ArrowDown")
    page.wait_for_selector('tr[data-car="n6"].chosen')
    page.keyboard.press("ArrowDown")
    page.wait_for_selector('tr[data-car="n5"].chosen')
    page.wait_for_selector('.chosen-car:has-text("remote")')


def test_a_car_is_added_and_taken_off_again(visit, running):
    visited = visit("/map")
    page = visited.page
    page.wait_for_selector('tr[data-car="n6"]')
    page.click('button:text("Add a car")')
    page.fill("dialog input[name=vehicle]", "guest")
    page.keyboard.press("Enter")
    page.wait_for_selector('.chosen-car:has-text("guest")')
    page.wait_for_selector('tr[data-car="guest"].chosen')
    names = [car["vehicle"] for car in running.get("/vehicles")["vehicles"]]
    assert "guest" in names
    page.click('.acts button:text("Remove")')
    page.wait_for_selector("dialog[open] .danger")
    page.keyboard.press("Enter")
    page.wait_for_selector('tr[data-car="guest"]', state="detached")
    names = [car["vehicle"] for car in running.get("/vehicles")["vehicles"]]
    assert "guest" not in names
    # Between its leaving and the page's hearing of it, its path may have been asked for.
    assert [said for said in visited.complaints if "404" not in said] == []


def test_cars_that_leave_while_another_is_chosen_do_no_harm(visit):
    visited = visit("/map")
    visited.page.wait_for_selector('tr[data-car="n6"]')
    visited.page.evaluate(
        f"""async () => {{
            const {{ fleet }} = await import('{FLEET}');
            const {{ selected }} = await import('{SELECTION}');
            selected.value = "n6";
            await Promise.resolve();  // the table is made anew, and not yet scrolled
            const vehicles = fleet.vehicles.slice(0, 1);
            Object.assign(fleet, {{ generation: -1, vehicles, count: 0 }});
            document.querySelector('.cars .scroll').dispatchEvent(
                new KeyboardEvent('keydown', {{ key: 'ArrowUp', bubbles: true }}));
            await new Promise((done) => setTimeout(done, 500));
        }}"""
    )
    assert visited.complaints == []


def test_signals_have_letter_and_time_and_lead_to_their_junction(visit):
    visited = visit("/map")
    page = visited.page
    visited.wait(
        """() => {
            const heads = [...document.querySelectorAll('.signals-short .head')];
            return heads.length && heads.every(head => /^[RYGF]$/.test(head.innerText.trim()));
        }"""
    )
    groups = page.locator(".signals-short li").all_inner_texts()
    assert [text.split()[1:3] for text in groups] == [["south", "east"], ["south", "west"]]
    assert page.get_attribute(".signals-short a", "href") == "/signals/crossing"


def test_frames_go_on_while_nothing_is_touched(visit):
    visited = visit("/map")
    before = visited.page.evaluate(f"async () => (await import('{SCENE}')).drawn.frames")
    visited.wait(f"async (before) => (await import('{SCENE}')).drawn.frames > before + 5", before)


SMALL_CAR = """async ([px_per_m, ratio, yaw, alive, x, y]) => {
    const { drawSprites } = await import('/static/js/pages/map/sprites.js');
    const sheet = new OffscreenCanvas(120 * ratio, 120 * ratio);
    const paper = sheet.getContext('2d');
    const [x_px, y_px] = [(x_m) => 60 + px_per_m * x_m, (y_m) => 60 - px_per_m * y_m];
    const view = { scale: px_per_m, x: x_px, y: y_px };
    const fleet = { vehicles: [{ car: 'nigel', kind: 'hosted' }], flags: [alive] };
    drawSprites(paper, view, ratio, fleet, { x: [x], y: [y], yaw: [yaw] }, [0]);
    const { data } = paper.getImageData(0, 0, sheet.width, sheet.height);
    const [c, s] = [Math.cos(yaw), Math.sin(yaw)];
    const [along, across] = [[], []];
    let blue = 0;
    for (let i = 0; i < sheet.width * sheet.height; i++) {
        if (data[4 * i + 3] < 128) continue;
        const dx = ((i % sheet.width) + 0.5) / ratio - 60 - px_per_m * x;
        const dy = 60 - (Math.floor(i / sheet.width) + 0.5) / ratio - px_per_m * y;
        along.push(dx * c + dy * s);
        across.push(dy * c - dx * s);
        blue += data[4 * i + 2] > data[4 * i] + 40;
    }
    const mean = (list) => list.reduce((sum, far) => sum + far, 0) / list.length;
    return {
        rear: Math.min(...along), front: Math.max(...along),
        centre: mean(along), aside: mean(across), blue: blue / along.length,
    };
}"""


def test_small_cars_are_drawn_where_they_are_and_point_where_they_drive(visit):
    page = visit("/map").page
    places = ((0.0, 0.0, 0.0), (0.117, 0.033, 2.0), (-0.041, 0.096, -1.1), (0.0213, 0.05, 3.6))
    for ratio, px_per_m in itertools.product((1, 2), (20.0, 60.0, 70.0, 160.0)):
        for x_m, y_m, yaw_rad in places:
            car = page.evaluate(SMALL_CAR, [px_per_m, ratio, yaw_rad, 1, x_m, y_m])
            middle, length = (car["front"] + car["rear"]) / 2, car["front"] - car["rear"]
            assert middle == pytest.approx(0.08 * px_per_m, abs=0.8)
            assert car["aside"] == pytest.approx(0.0, abs=0.4)
            assert length == pytest.approx(max(13.0, 0.30 * px_per_m), rel=0.1, abs=1.5)
            assert car["blue"] > 0.35
            assert length > 24 or car["centre"] < middle - 0.5, "the pointed end is ahead"
        lost = page.evaluate(SMALL_CAR, [px_per_m, ratio, 0.0, 0, 0.0, 0.0])
        assert lost["blue"] < 0.05, "a lost car is grey"
