"""What every page has: the bar, the red stop, stale data, colours, keyboard, small windows."""

from urllib.parse import urlsplit

import pytest

from tests.e2e.pages.town import town
from tests.e2e.pages.visiting import Visit, judge

PAGES = ("map", "signals", "vehicles", "twins", "eye", "recordings", "mismatch", "events")


def release(running):
    """Let the city drive again."""
    running.web.put("/stop", json={"engaged": False, "by": "tests"}).raise_for_status()


def test_every_page_opens_from_the_bar_without_a_reload(visit):
    visited = visit("/")
    page = visited.page
    page.evaluate("() => { window.sameDocument = true }")
    for name in PAGES:
        page.click(f'nav a[href="/{name}"]')
        page.wait_for_selector(f"main.at-{name} > *")
        assert page.get_attribute(f'nav a[href="/{name}"]', "aria-current") == "page"
    page.go_back()
    page.wait_for_selector("main.at-mismatch > *")
    assert page.evaluate("() => window.sameDocument")
    assert visited.complaints == []


def test_the_bar_answers_before_the_page_is_drawn(visit):
    page = visit("/map").page
    page.wait_for_selector("main.at-map canvas")
    seen = page.evaluate("""async () => {
        document.querySelector('nav a[href="/events"]').click();
        await new Promise(requestAnimationFrame);
        const here = document.querySelector("nav [aria-current]").textContent.trim();
        return [here, document.querySelector("main").className];
    }""")
    assert seen == ["Events", "at-map"]
    page.wait_for_selector("main.at-events > *")
    assert "/events" in page.url


def test_who_turns_back_at_once_stays(visit):
    page = visit("/map").page
    page.wait_for_selector("main.at-map canvas")
    seen = page.evaluate("""async () => {
        const pages = new Set();
        const main = document.querySelector("main");
        const note = new MutationObserver(() => pages.add(main.className));
        note.observe(main, { attributes: true });
        for (const name of ["events", "map"]) {
            document.querySelector(`nav a[href="/${name}"]`).click();
        }
        for (let frame = 0; frame < 5; frame++) await new Promise(requestAnimationFrame);
        return [[...pages], document.querySelector("nav [aria-current]").textContent.trim()];
    }""")
    assert seen == [[], "Map"]


def test_an_address_that_is_no_page_says_so(visit):
    page = visit("/map").page
    page.evaluate("() => history.pushState(null, '', '/nowhere')")
    page.evaluate("() => dispatchEvent(new PopStateEvent('popstate'))")
    page.wait_for_selector("main.at-nowhere a[href='/map']")
    assert visit("/typo").page.inner_text("main").startswith("There is no such page.")
    visited = visit("/vehicles/%ZZ")  # no character has that number
    visited.page.wait_for_selector("main >> text=No vehicle named %ZZ is in the city")
    assert visited.complaints == []


SHOW_LINK = """words => {
  const light = document.querySelector(".link-state");
  light.lastChild.data = words;
  return [document.querySelector("#city-stop"), light].map(
    (shown, end) => shown.getBoundingClientRect()[end ? "bottom" : "top"]);
}"""


@pytest.mark.parametrize("name", PAGES)
def test_the_red_stop_is_on_every_page(visit, name):
    page = visit(f"/{name}", "narrow").page
    assert page.locator("#city-stop").is_visible()
    link = page.locator("header nav [aria-current]").bounding_box()
    frame = page.locator("header nav").bounding_box()
    assert frame["x"] - 1 <= link["x"], "the page's own link is out of sight"
    assert link["x"] + link["width"] <= frame["x"] + frame["width"] + 1
    page.set_viewport_size({"width": 360, "height": 740})
    for words in ("Live", "Connecting"):  # the shortest and the longest
        stop_px, light_px = page.evaluate(SHOW_LINK, words)
        assert stop_px < light_px, f"at {words!r} the red button fell into another line"


def test_the_frame_stands_before_any_script_runs(browser, running):
    context = browser.new_context(java_script_enabled=False)
    page = context.new_page()
    page.goto(f"{running.url}/map")
    assert page.locator("nav a[aria-current=page]").inner_text() == "Map"
    assert page.locator("section.panel, details.panel").count() == 4
    assert page.locator(".city-stop").is_disabled()
    wide = "() => [document.documentElement.scrollWidth, window.innerWidth]"
    content, window = page.evaluate(wide)
    assert content <= window
    context.close()


def test_no_module_of_the_first_page_is_found_late(visit):
    page = visit("/map").page
    page.wait_for_selector("main.at-map canvas")
    late = """() => {
        const links = [...document.querySelectorAll("link[rel=modulepreload]")];
        const named = new Set(links.map((link) => link.href));
        const got = performance.getEntriesByType("resource").map((one) => one.name);
        return got.filter((name) => /\\.m?js$/.test(name) && !named.has(name));
    }"""
    assert page.evaluate(late) == []


def test_the_red_stop_works_though_the_page_does_not_come(browser, running):
    page = browser.new_context().new_page()
    held = []

    def hold(route):
        held.append(route)

    page.route("**/pages/map/page.js", hold)
    page.goto(f"{running.url}/map")
    try:
        page.click("#city-stop")
        page.wait_for_selector(".banner.stopped")
    finally:
        release(running)
    page.wait_for_selector(".banner.stopped", state="detached")
    for route in held:
        route.continue_()
    page.wait_for_selector("main.at-map canvas")
    page.context.close()


def test_the_colours_that_the_person_chose_are_there_before_the_modules(browser, running):
    page = browser.new_context(color_scheme="light").new_page()
    page.route("**/js/app.js", lambda route: route.abort())
    page.goto(f"{running.url}/map")
    ground = "() => getComputedStyle(document.body).backgroundColor"
    light = page.evaluate(ground)
    page.evaluate("() => localStorage.setItem('scm-theme', 'dark')")
    page.reload()
    assert page.evaluate(ground) != light
    page.context.close()


def test_one_press_stops_the_city_and_only_a_yes_lets_it_go(visit, running):
    visited = visit("/events")
    page = visited.page
    page.focus("#city-stop")
    try:
        page.keyboard.press("Enter")
        page.wait_for_selector(".banner.stopped >> text=by dashboard")
        assert running.get("/stop")["engaged"]
        page.click("text=Give a reason…")
        page.fill("dialog input[name=reason]", "a hand on the floor")
        page.keyboard.press("Enter")
        page.wait_for_selector(".banner.stopped >> text=a hand on the floor")
        judge(visited)
        page.click("#city-stop")
        page.click("dialog >> text=Let all cars drive again")
        visited.until(lambda: not running.get("/stop")["engaged"], "the stop is released")
    finally:
        release(running)
    page.wait_for_selector(".banner.stopped", state="detached")


def test_who_hits_the_red_button_again_and_again_does_not_release_it(visit, running):
    page = visit("/map").page
    page.focus("#city-stop")
    try:
        page.keyboard.press("Enter")
        page.wait_for_selector(".banner.stopped")
        for _ in range(4):
            page.keyboard.press("Enter")
            page.wait_for_timeout(20)
        page.keyboard.press("Escape")
        page.wait_for_selector("dialog", state="detached")
        assert running.get("/stop")["engaged"]
    finally:
        release(running)
    page.wait_for_selector(".banner.stopped", state="detached")


def test_a_reason_that_comes_after_the_release_stops_nobody_again(visit, running):
    page = visit("/map").page
    try:
        page.click("#city-stop")
        page.click("text=Give a reason…")
        page.wait_for_selector("dialog[open]")
    finally:
        release(running)
    page.wait_for_selector(".banner.stopped", state="detached")
    page.fill("dialog input[name=reason]", "too late")
    page.keyboard.press("Enter")
    page.wait_for_selector("text=The stop was released meanwhile")
    assert not running.get("/stop")["engaged"]


def test_the_red_stop_works_though_all_connections_of_the_browser_are_taken(visit, running):
    visited = visit("/map")
    page = visited.page
    page.wait_for_selector("tr[data-car]")
    page.evaluate("""async () => {
        const open = (one) => new Promise((done) => (one.onopen = done));
        window.taken = [1, 2, 3, 4].map(() => new EventSource("/api/v1/stream?topics=pulse"));
        await Promise.all(window.taken.map(open));
    }""")
    try:
        page.click("#city-stop")
        visited.until(lambda: running.get("/stop")["engaged"], "the city is stopped")
        page.wait_for_selector(".banner.stopped")
    finally:
        page.evaluate("() => window.taken.forEach((one) => one.close())")
        release(running)
    page.wait_for_selector(".banner.stopped", state="detached")


def test_a_page_that_nobody_looks_at_leaves_its_connections_to_others(visit):
    visited = visit("/map")
    page = visited.page
    page.wait_for_selector("tr[data-car]")
    ended = []
    page.on("requestfailed", lambda request: ended.append(request.url.rpartition("/")[2]))
    hide = """(hidden) => {
        Object.defineProperty(document, "hidden", { value: hidden, configurable: true });
        document.dispatchEvent(new Event("visibilitychange"));
    }"""
    page.evaluate(hide, True)
    visited.until(lambda: len(ended) == 2, "both streams end")
    assert sorted(name.partition("?")[0] for name in ended) == ["stream", "vehicles.bin"]
    page.evaluate(hide, False)
    page.wait_for_selector('.page[data-link="live"]')
    page.wait_for_selector('.sheet[data-link="live"]')


def test_a_key_is_asked_for_once_though_two_want_it(visit):
    visited = visit("/events")
    visited.page.evaluate("""() => {
        let isOpen = false;
        const own = window.fetch;
        window.fetch = async (address, options) => {
            if (address !== "/api/v1/session") return own(address, options);
            isOpen ||= options?.headers?.Authorization === "Bearer sesame";
            return new Response("{}", { status: isOpen ? 200 : 401 });
        };
        import("/static/js/shell/api.js")
            .then(({ enter }) => Promise.all([enter(), enter()]))
            .then((entered) => (window.entered = entered));
    }""")
    visited.page.fill("dialog input[name=key]", "mumble")
    visited.page.keyboard.press("Enter")
    visited.page.wait_for_selector("dialog .notice >> text=The city does not accept this key")
    visited.page.fill("dialog input[name=key]", "sesame")
    visited.page.keyboard.press("Enter")
    visited.wait("() => window.entered?.every(Boolean)")


def test_the_colours_follow_the_choice_of_the_person(visit):
    page = visit("/map", theme="light").page
    ground = "() => getComputedStyle(document.body).backgroundColor"
    light = page.evaluate(ground)
    page.click("button.theme")  # light
    assert page.evaluate(ground) == light
    page.click("button.theme")  # dark
    assert page.evaluate(ground) != light
    page.reload()
    page.wait_for_selector("button.theme[aria-label$=dark]")
    assert page.evaluate(ground) != light


def test_the_keyboard_skips_the_bar(visit):
    page = visit("/map").page
    page.keyboard.press("Tab")
    page.keyboard.press("Enter")
    assert page.evaluate("() => document.activeElement.id") == "main"


def test_below_a_path_every_page_opens_and_the_red_stop_gets_through(browser, tmp_path):
    with town("driving_school", tmp_path, base="/city") as running:
        page = browser.new_context().new_page()
        visited = Visit(page)
        page.goto(f"{running.url}/city/")
        page.wait_for_selector('.link-state[data-link="live"]')
        page.wait_for_selector(".cars tbody tr >> text=n1")
        for name in (*PAGES[1:], "map"):
            page.click(f'nav a[href="/city/{name}"]')
            page.wait_for_selector(f"main.at-{name} > *")
            assert urlsplit(page.url).path == f"/city/{name}"
        page.go_back()
        page.wait_for_selector("main.at-events > *")
        page.reload()
        page.wait_for_selector("main.at-events > *")
        page.click("#city-stop")
        page.wait_for_selector(".banner.stopped")
        asked = page.evaluate(
            "() => performance.getEntriesByType('resource').map(({name}) => name)"
        )
        assert {urlsplit(address).path.split("/")[1] for address in asked} == {"city"}
        page.context.close()
    assert visited.complaints == []
