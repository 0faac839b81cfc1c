"""The events page over a real city: what happened is found, acknowledged, exported; and audited."""

import json

import pytest

from tests.e2e.pages.visiting import LOOKS, in_both_themes, judge, photograph

STORE = "scm/shell/store.js"
ROWS = ".at-events .entries > li"


def stop_and_go(running, reason):
    """Make two events and four deeds that everybody sees; return the trace of the last two."""
    for engaged in (True, False):
        body = {"engaged": engaged, "by": "ada", "reason": reason}
        answer = running.web.put("/stop", json=body).raise_for_status()
    return answer.headers["trace-id"]


@pytest.mark.parametrize(("size", "theme"), LOOKS)
def test_the_log_is_readable_at_every_size_and_in_both_colours(look, running, size, theme):
    stop_and_go(running, "a hand on the floor")
    visited = look("/events", "events", size, theme, ready=f"{ROWS} >> text=a hand on the floor")
    visited.page.click('.at-events .tabs a[href="/events/audit"]')
    visited.page.wait_for_selector(".at-events [data-request]")
    for shown in in_both_themes(visited, theme):
        judge(visited)
        photograph(visited, f"audit_{size}_{shown}")


def test_a_person_finds_follows_acknowledges_and_takes_back(visit, running):
    visited = visit("/events")
    page = visited.page
    stop_and_go(running, "a marble on lane two")
    mine = f"{ROWS}:has-text('a marble on lane two')"
    page.wait_for_selector(mine)
    page.fill("input[aria-label='Find in events']", "marble")
    page.click(".chips [data-severity=warning]")
    page.wait_for_selector(f"{ROWS}:not(:has-text('marble'))", state="detached")
    page.locator(f"{mine} >> text=Acknowledge").first.focus()
    page.keyboard.press("Enter")
    page.fill("dialog input[name=note]", "rolled away")
    page.keyboard.press("Enter")
    page.wait_for_selector(f"{mine} >> text=rolled away")
    (row, *_) = running.get("/events?text=marble")["items"]
    assert (row["acknowledged_by"], row["note"]) == ("dashboard", "rolled away")
    href = page.get_attribute(".export a[href*='jsonl']", "href")
    lines = running.web.get(href.removeprefix("/api/v1")).text.splitlines()
    assert {json.loads(line)["severity"] for line in lines} == {"warning"}
    assert all("marble" in line for line in lines)
    page.check("label.tick input")
    page.wait_for_selector(f"{mine} >> text=rolled away", state="detached")
    page.uncheck("label.tick input")
    page.locator(f"{mine} >> button[aria-label^='Withdraw']").first.click()
    visited.until(
        lambda: running.get("/events?text=marble")["items"][0]["acknowledged_by"] is None,
        "the acknowledgement is taken back",
    )
    assert visited.complaints == []


def test_names_are_read_and_found_as_people_say_them_and_stay_as_they_are_in_data(visit, running):
    wish = {"groups": ["south_east"], "by": "tests", "reason": "a bus"}
    running.web.post("/signals/crossing/calls", json=wish).raise_for_status()
    page = visit("/events").page
    page.fill("input[aria-label='Find in events']", "call south east")
    page.wait_for_selector(f"{ROWS}:has-text('crossing call south east (tests asked: a bus)')")
    (row, *_) = running.get("/events?text=call%20south%20east")["items"]
    assert "call south_east" in row["text"]


def test_a_paused_log_stands_still_until_it_is_followed_again(visit, running):
    visited = visit("/events")
    page = visited.page
    page.wait_for_selector(ROWS)
    page.click("text=Pause")
    page.wait_for_selector(".paused")
    stop_and_go(running, "while nobody looks")
    visited.until(lambda: running.get("/events?text=nobody")["items"], "it is in the log")
    visited.until(lambda: not running.get("/stop")["engaged"], "the stop is released")
    page.wait_for_timeout(500)  # ten frames of the stream
    assert "while nobody looks" not in page.inner_text(".at-events .entries")
    page.click("text=Follow")
    page.wait_for_selector(f"{ROWS} >> text=while nobody looks")
    page.evaluate(f"async () => {{ (await import('{STORE}')).events.value = []; }}")
    page.wait_for_timeout(200)  # the page was drawn anew
    assert "while nobody looks" in page.inner_text(".at-events .entries")
    with page.expect_response(lambda answer: "/events?limit=200" in answer.url):  # what it missed
        page.evaluate(
            f"""async () => {{
              const {{ events }} = await import('{STORE}');
              const [row] = (await (await fetch("/api/v1/events?limit=1")).json()).items;
              events.value = [{{ ...row, id: "0123456789abcdef", seq: row.seq + 500 }}];
            }}"""
        )


def test_the_audit_names_who_did_what_and_its_chain_is_whole(visit, running):
    trace = stop_and_go(running, "for the audit")
    visited = visit("/events/audit")
    page = visited.page
    page.fill("input[aria-label='Find in the audit trail']", "for the audit")
    deed = ".at-events [data-request]:has-text('stop the city')"
    page.wait_for_selector(deed)
    assert "world" in page.locator(deed).first.inner_text()
    page.set_viewport_size({"width": 390, "height": 844})
    for cell in ("what", "by", "answer"):  # a telephone shows who did it without being pushed aside
        box = page.locator(f"{deed} .{cell}").first.bounding_box()
        assert box["x"] + box["width"] <= 390
    page.locator(f"{deed} .name").first.click()
    assert "for the audit" in page.inner_text(".at-events .whole pre")
    page.click(".at-events .whole .trace button")
    rows = page.locator(".at-events [data-request]")
    stations = rows.locator(".station")
    visited.until(lambda: stations.all_inner_texts() == ["world, api"], "one row has both")
    assert "200 in" in rows.locator(".answer").inner_text()
    assert rows.locator(".by").inner_text() == "ada (python-httpx)"
    told = [json.loads(text) for text in page.locator(".at-events .whole pre").all_inner_texts()]
    assert [entry["kind"] for entry in told] == ["StopRequest", "PUT /api/v1/stop"]
    numbers = [str(entry["number"]) for entry in told]
    assert rows.locator(".number").inner_text() == ", ".join(numbers)
    deeds = running.get(f"/audit?text={trace}")["items"]
    assert [(deed["station"], deed["trace_id"]) for deed in deeds] == [
        ("api", trace),
        ("world", trace),
    ], "a click, and what the world did for it"
    page.select_option("select[aria-label='Done by']", "api")  # its own entries alone
    page.wait_for_selector(".at-events [data-request]:has-text('engage or release')")
    page.select_option("select[aria-label='Done by']", "")
    refused = running.web.put("/stop", json={"engaged": "perhaps"})
    page.fill("input[aria-label='Find in the audit trail']", refused.headers["trace-id"])
    page.wait_for_selector(".at-events [data-request]:has-text('engage or') .warn >> text=422 in")
    page.click("text=Check the chain")
    page.wait_for_selector(".chain >> text=whole:")


def test_what_is_told_late_stands_where_it_happened(visit, running):
    page = visit("/map").page

    def answer(route):
        rows = running.get("/events?limit=2")["items"]
        late = rows[0] | {"id": "late", "seq": 0, "t_ns": 4 * 10**18, "text": "told late"}
        route.fulfill(json={"items": [*rows, late], "next": None})

    page.route("**/api/v1/events?**", answer)
    page.click('nav a[href="/events"]')
    page.wait_for_selector(f"{ROWS} >> text=told late")
    assert "told late" in page.locator(ROWS).first.inner_text()
    page.unroute("**/api/v1/events?**")
