import hashlib
import json
import os
import re
import shutil

import pytest
from msgspec.structs import fields as fields_of

from scm.api import dashboard
from scm.api.dashboard import PAGES, STATIC_DIR, page_text
from scm.records.eye_calibrations import BackBody
from scm.records.signals import FlashBody, PlanChoiceBody, ResetBody

OURS = sorted((STATIC_DIR / "js").rglob("*.js"))
STYLES = sorted((STATIC_DIR / "css").rglob("*.css"))
DOCUMENTS = sorted(STATIC_DIR.glob("*.html"))
FRAMES = sorted((STATIC_DIR / "frames").glob("*.html"))
UNDER = {"cars": "vehicles"}
"""Pages that the bar shows as another."""
IMPORTED = re.compile(r'(?m)^(?:import|\}|export)?[^"\n]*\b(?:from|import\() ?"([^"]+)"')


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


@pytest.mark.parametrize("path", OURS, ids=str)
def test_what_a_person_types_is_not_reset_when_the_page_is_drawn_again(path):
    """Preact sets `value` at each drawing; a field that reports no input takes `defaultValue`."""
    fields = re.findall(r"<(?:input|textarea)\b(?:=>|[^>])*>", path.read_text("utf-8"))
    for field in fields:
        is_set = re.search(r"\s(value|checked)=(\$|\")", field)
        is_choice = re.search(r'type="(radio|checkbox|submit|hidden)"', field)
        assert not is_set or is_choice or "onInput" in field, field


@pytest.mark.parametrize("path", [*OURS, *DOCUMENTS, *FRAMES, *STYLES], ids=str)
def test_nothing_of_ours_points_to_another_host(path):
    assert not re.search(r"(?:https?:)?//[a-z0-9-]+\.[a-z]", path.read_text("utf-8"))


@pytest.fixture(scope="module")
def place():
    """Tell the file that an import leads to."""
    (page,) = [page for page in DOCUMENTS if page.name == "index.html"]
    mapping = json.loads(
        re.search(r"<script type=\"importmap\">(.*?)</script>", page.read_text("utf-8"), re.DOTALL)[
            1
        ]
    )["imports"]

    def of(target):
        if target.startswith("scm/"):
            return STATIC_DIR / "js" / target.removeprefix("scm/")
        return STATIC_DIR / mapping[target].removeprefix("/static/")

    return of


@pytest.mark.parametrize("path", OURS, ids=lambda path: path.name)
def test_every_import_leads_to_a_file(path, place):
    for target in IMPORTED.findall(path.read_text("utf-8")):
        assert place(target).is_file(), target


NAMED_IMPORT = re.compile(r'import \{([^}]*)\} from "(scm/[^"]+)"')
EXPORTED = re.compile(r"(?m)^export (?:async )?(?:const|let|function\*?|class) (\w+)")


@pytest.mark.parametrize("path", OURS, ids=lambda path: path.name)
def test_every_imported_name_is_exported(path, place):
    for names, target in NAMED_IMPORT.findall(path.read_text("utf-8")):
        exported = set(EXPORTED.findall(place(target).read_text("utf-8")))
        wanted = {name.split(" as ")[0].strip() for name in names.split(",") if name.strip()}
        assert wanted <= exported, target


@pytest.mark.parametrize("page", PAGES)
def test_a_page_names_every_module_that_it_will_import(page, place):
    named = set(re.findall(r'<link rel="modulepreload" href="(.*?)">', page_text(page)))
    files = {STATIC_DIR / address.removeprefix("/static/") for address in named}
    (own,) = [path for path in files if path.name == "page.js"]
    assert own.parent.name in page  # `vehicles` shows `vehicle`
    assert STATIC_DIR / "js/app.js" in files
    assert all(path.is_file() for path in files)
    for path in files - {STATIC_DIR / "js/pages/index.js"}:  # it loads a page when that is shown
        if path.suffix == ".js":
            for target in IMPORTED.findall(path.read_text("utf-8")):
                assert place(target) in files, f"{path.name} imports {target}"
    assert STATIC_DIR / "vendor/signals-core.mjs" in files  # only another vendored one imports it


def test_a_page_asks_for_a_reason_where_rest_needs_one_and_nowhere_else():
    needs = {"pages/eye/in_force.js": BackBody, "pages/signals/monitor.js": ResetBody}
    offers = {"pages/signals/plans.js": PlanChoiceBody, "pages/signals/overrides.js": FlashBody}
    field = re.compile(r'<input[^>]*name="reason"[^>]*>', re.DOTALL)
    for place, body in (needs | offers).items():
        fields = field.findall((STATIC_DIR / "js" / place).read_text("utf-8"))
        (reason,) = (one for one in fields_of(body) if one.name == "reason")
        is_needed = reason.required
        assert is_needed == (place in needs)
        assert fields, place
        assert all(("required" in one) == is_needed for one in fields), place
        assert all(("optional" in one) != is_needed for one in fields), place


def test_every_page_of_the_bar_has_an_address_and_a_style_sheet():
    index = (STATIC_DIR / "js" / "pages" / "index.js").read_text("utf-8")
    assert re.findall(r'name: "([a-z]+)"', index) == list(PAGES)
    for name in PAGES:
        assert (STATIC_DIR / "css" / "pages" / f"{name}.css").is_file(), name


@pytest.mark.parametrize("page", ["", *PAGES, "vehicles/n1"])
def test_every_page_is_served_at_its_own_address(client, page):
    answer = client("GET", f"/{page}")
    assert (answer.status_code, answer.headers["content-type"][:9]) == (200, "text/html")


def test_the_frame_has_the_bar_that_the_modules_draw():
    index = (STATIC_DIR / "js" / "pages" / "index.js").read_text("utf-8")
    pages = re.findall(r'name: "([a-z]+)", title: "(\w+)"', index)
    assert re.findall(r'<a href="/([a-z]+)">(\w+)</a>', dashboard.index_text()) == pages


@pytest.mark.parametrize("page", PAGES)
def test_a_page_is_told_what_its_address_shows(client, page):
    text = client("GET", f"/{page}/some/where").text
    assert re.findall(r'href="/(\w+)" aria-current="page"', text) == [UNDER.get(page, page)]
    assert f'<main class="at-{page}">' in text
    assert f'<link rel="stylesheet" href="/static/css/pages/{page}.css">' in text
    assert dashboard.NEEDS not in text


@pytest.mark.parametrize("frame", FRAMES, ids=lambda path: path.name)
def test_nothing_of_a_frame_can_be_pressed_before_its_modules_run(frame):
    text = frame.read_text("utf-8") + dashboard.INDEX.read_text("utf-8")
    for control in re.findall(r"<(?:button|input|select)\b[^>]*>", text):
        assert " disabled" in control, control


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


def test_a_file_is_packed_for_who_takes_it_so(client):
    path = "/static/js/shell/store.js"
    plain = client("GET", path, headers={"Accept-Encoding": "identity"})
    packed = client("GET", path, headers={"Accept-Encoding": "gzip"})
    assert "content-encoding" not in plain.headers
    assert packed.headers["content-encoding"] == "gzip"
    assert packed.content == plain.content == (STATIC_DIR / "js/shell/store.js").read_bytes()
    assert int(packed.headers["content-length"]) < len(plain.content) / 2
    assert packed.headers["etag"] != plain.headers["etag"]
    assert packed.headers["vary"] == plain.headers["vary"] == "accept-encoding"


def test_the_head_of_a_file_says_what_the_file_would(client):
    whole, head = (client(method, "/static/css/theme.css") for method in ("GET", "HEAD"))
    assert (head.status_code, head.content) == (200, b"")
    assert {**whole.headers, "trace-id": ""} == {**head.headers, "trace-id": ""}


def test_a_file_that_was_edited_is_seen_at_the_next_visit(app, client_of, tmp_path, monkeypatch):
    folder = shutil.copytree(STATIC_DIR, tmp_path / "static")
    monkeypatch.setattr(dashboard, "STATIC_DIR", folder)
    monkeypatch.setattr(dashboard, "INDEX", folder / "index.html")
    client = client_of(app)
    before = client("GET", "/static/icon.svg"), client("GET", "/events")
    for name in ("icon.svg", "index.html"):
        path = folder / name
        path.write_text(path.read_text("utf-8") + "<!-- edited -->", "utf-8")
        os.utime(path, (1e9, 1e9))
    after = client("GET", "/static/icon.svg"), client("GET", "/events")
    for old, new in zip(before, after, strict=True):
        assert new.status_code == 200
        assert new.text == old.text + "<!-- edited -->"
        assert new.headers["etag"] != old.headers["etag"]


def test_files_are_counted_by_what_they_are(client):
    for path in ("/static/icon.svg", "/static/js/app.js", "/vehicles/n1", "/"):
        client("GET", path)
    told = client("GET", "/metrics").text
    assert 'scm_requests_total{method="GET",route="/static/{file}",status="200"} 2.0' in told
    assert 'scm_requests_total{method="GET",route="/vehicles",status="200"} 1.0' in told
    assert 'scm_requests_total{method="GET",route="/",status="200"} 1.0' in told
