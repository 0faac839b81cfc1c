import hashlib
import json
import re

import pytest

from scm.api.app import PAGES, STATIC_DIR

OURS = sorted((STATIC_DIR / "js").rglob("*.js"))
STYLES = sorted((STATIC_DIR / "css").rglob("*.css"))
DOCUMENTS = sorted(STATIC_DIR.glob("*.html"))


def test_vendored_modules_are_what_the_table_says():
    table = (STATIC_DIR / "vendor" / "VENDORED.md").read_text("utf-8")
    rows = re.findall(r"^\| (\S+\.mjs) \|.*\| ([0-9a-f]{64}) \|$", table, re.MULTILINE)
    found = {
        path.name: hashlib.sha256(path.read_bytes()).hexdigest()
        for path in (STATIC_DIR / "vendor").glob("*.mjs")
    }
    assert dict(rows) == found
    assert len(found) == 6


@pytest.mark.parametrize("path", OURS, ids=lambda path: path.name)
def test_no_script_writes_markup_from_data(path):
    text = path.read_text("utf-8")
    for danger in ("innerHTML", "outerHTML", "insertAdjacentHTML", "document.write", "eval("):
        assert danger not in text


@pytest.mark.parametrize("path", [*OURS, *DOCUMENTS, *STYLES], ids=str)
def test_nothing_of_ours_points_to_another_host(path):
    assert not re.search(r"(?:https?:)?//[a-z0-9-]+\.[a-z]", path.read_text("utf-8"))


@pytest.mark.parametrize("path", OURS, ids=lambda path: path.name)
def test_every_import_leads_to_a_file(path):
    (page,) = [page for page in DOCUMENTS if page.name == "index.html"]
    mapping = json.loads(
        re.search(r"<script type=\"importmap\">(.*?)</script>", page.read_text("utf-8"), re.DOTALL)[
            1
        ]
    )["imports"]
    for target in re.findall(
        r'(?m)^(?:import|\}|export)?[^"\n]*\b(?:from|import\() ?"([^"]+)"', path.read_text("utf-8")
    ):
        if target.startswith("scm/"):
            assert (STATIC_DIR / "js" / target.removeprefix("scm/")).is_file(), target
        else:
            assert (STATIC_DIR / mapping[target].removeprefix("/static/")).is_file(), target


def test_every_page_of_the_bar_has_an_address_and_a_style_sheet():
    index = (STATIC_DIR / "js" / "pages" / "index.js").read_text("utf-8")
    assert tuple(re.findall(r'name: "([a-z]+)"', index)) == PAGES
    for name in PAGES:
        assert (STATIC_DIR / "css" / "pages" / f"{name}.css").is_file(), name


@pytest.mark.parametrize("page", ["", *PAGES, "vehicles/n1"])
def test_every_page_is_served_at_its_own_address(client, page):
    answer = client("GET", f"/{page}")
    assert (answer.status_code, answer.headers["content-type"][:9]) == (200, "text/html")


def test_both_pages_have_the_same_inline_script_so_one_policy_fits():
    scripts = {
        re.search(r"<script type=\"importmap\">.*?</script>", page.read_text("utf-8"), re.DOTALL)[0]
        for page in DOCUMENTS
    }
    assert len(scripts) == 1


@pytest.mark.parametrize(
    ("path", "kind"),
    [
        ("/", "text/html"),
        ("/docs", "text/html"),
        ("/static/js/app.js", "text/javascript"),
        ("/static/vendor/preact.mjs", "text/javascript"),
        ("/static/css/theme.css", "text/css"),
    ],
)
def test_files_are_served_to_be_asked_for_again(client, path, kind):
    response = client("GET", path)
    assert response.status_code == 200
    assert response.headers["content-type"].startswith(kind)
    assert response.headers["cache-control"] == "no-cache"
    assert response.headers["etag"]
    again = client("GET", path, headers={"If-None-Match": response.headers["etag"]})
    assert again.status_code in (200, 304)


def test_a_static_file_already_known_is_not_sent_again(client):
    etag = client("GET", "/static/js/app.js").headers["etag"]
    again = client("GET", "/static/js/app.js", headers={"If-None-Match": etag})
    assert (again.status_code, again.content) == (304, b"")


@pytest.mark.parametrize("path", ["/static/../app.py", "/static/%2e%2e/app.py", "/static/none.js"])
def test_nothing_outside_the_folder_is_served(client, path):
    assert client("GET", path).status_code == 404
