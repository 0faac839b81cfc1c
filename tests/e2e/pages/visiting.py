"""A page that is looked at: what it waits for, what it complains of, and what must hold of all."""

import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

SIZES = {"wide": (1440, 900), "narrow": (360, 780)}
THEMES = ("light", "dark")
LOOKS = tuple(zip(SIZES, THEMES, strict=True))
"""The sizes and themes in which a page is opened; it is shown in the other theme after."""
PATIENCE_MS = 90_000
SERIOUS = {"serious", "critical"}


class Visit:
    """A page that remembers everything it complained about and every host it asked."""

    def __init__(self, page: Any) -> None:
        self.page = page
        self.complaints: list[str] = []
        self.hosts: set[str] = set()
        page.set_default_timeout(PATIENCE_MS)
        page.on("console", self._on_console)
        page.on("pageerror", self._on_error)
        page.on("request", self._on_request)

    def wait(self, expression: str, argument: Any = None) -> None:
        """Wait until JavaScript on the page is true."""
        self.page.wait_for_function(expression, arg=argument)

    def until(self, condition: Callable[[], Any], what: str) -> Any:
        """Wait for something on our side; the page lives on meanwhile."""
        for _ in range(PATIENCE_MS // 50):
            value = condition()
            if value:
                return value
            self.page.wait_for_timeout(50)
        msg = f"not within {PATIENCE_MS / 1000:g} s: {what}"
        raise AssertionError(msg)

    def forget(self) -> None:
        """Leave an empty window that knows nothing of this visit."""
        self.page.evaluate("() => { localStorage.clear(); sessionStorage.clear(); }")
        self.page.goto("about:blank")
        self.page.mouse.move(0, 0)
        self.page.remove_listener("console", self._on_console)
        self.page.remove_listener("pageerror", self._on_error)
        self.page.remove_listener("request", self._on_request)

    def _on_console(self, message: Any) -> None:
        is_late = "504" in message.text and message.location["url"].endswith("/link")
        if message.type in ("error", "warning") and not is_late:  # the page says "no answer"
            self.complaints.append(message.text)

    def _on_error(self, error: Any) -> None:
        self.complaints.append(str(error))

    def _on_request(self, request: Any) -> None:
        self.hosts.add(urlsplit(request.url).netloc)


def judge(visited: Visit, within: str | None = None) -> None:
    """Fail where the page complains, asks another host, scrolls sideways, or axe finds fault.

    Axe looks `within` what a selector names: it keeps the page from all else meanwhile.
    """
    page = visited.page
    assert not visited.complaints, "\n".join(visited.complaints)
    assert visited.hosts == {urlsplit(page.url).netloc}
    wide = "() => [document.documentElement.scrollWidth, window.innerWidth]"
    content, window = page.evaluate(wide)
    assert content <= window, f"the page is {content} px wide in a window of {window} px"
    faults = faults_of(page, within)
    assert not faults, "\n".join(faults)


def faults_of(page: Any, within: str | None = None) -> list[str]:
    """Return what axe-core calls serious or critical, each with what it is about."""
    from axe_playwright_python.base import AXE_SCRIPT

    if not page.evaluate("() => 'axe' in window"):
        page.evaluate(AXE_SCRIPT)
    options = {"resultTypes": ["violations"]}
    looked = "([where, options]) => axe.run(where, options)"
    found = page.evaluate(looked, [within or "html", options])["violations"]
    return [
        f"{fault['id']}: {node['html'][:160]} ({node['failureSummary'][:300]})"
        for fault in found
        if fault["impact"] in SERIOUS
        for node in fault["nodes"]
    ]


def in_each_look(visited: Visit) -> Iterator[tuple[str, str]]:
    """Show an open page wide in light and narrow in dark; it stays wide and light."""
    for size, theme in (("narrow", "dark"), ("wide", "light")):
        width, height = SIZES[size]
        visited.page.set_viewport_size({"width": width, "height": height})
        _show_in(visited, theme)
        yield size, theme


def in_both_themes(visited: Visit, first: str) -> Iterator[str]:
    """Show an open page in the theme in which it is, and in the other; it stays in the first."""
    other = THEMES[1 - THEMES.index(first)]
    for theme in (first, other):
        _show_in(visited, theme)
        yield theme
    _show_in(visited, first)


def _show_in(visited: Visit, theme: str) -> None:
    visited.page.emulate_media(color_scheme=theme)
    visited.wait("theme => document.documentElement.dataset.theme === theme", theme)


def photograph(visited: Visit, name: str) -> None:
    """Keep a picture of the page where SCM_PICTURES says; nothing without it."""
    folder = os.environ.get("SCM_PICTURES")
    if folder:
        Path(folder).mkdir(parents=True, exist_ok=True)
        visited.page.screenshot(path=Path(folder) / f"{name}.png")
