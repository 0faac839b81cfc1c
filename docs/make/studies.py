"""Draws the pictures of docs/shipped_studies.md from results: python docs/make/studies.py DIR ...

Each DIR is the folder of one of the studies in `studies/`, as `scm study run` leaves it.
"""

import sys
from pathlib import Path

from scm.mismatch.report.plot import Picture
from scm.study import tables
from scm.study.plots import plots_of
from scm.study.stored import read_results

PICTURES = Path(__file__).parents[1] / "pictures" / "studies"
MORE = (  # of the page's colours; a picture's own are in it
    ":root{--good:#1d7a3e;--question:#6b3fa0;--warn:#a35c00}"
    "@media(prefers-color-scheme:dark){:root{--good:#63c98a;--question:#c3a1f0;--warn:#f0b14a}}"
)


def main(folders: list[str]) -> None:
    """Write a picture of each measure of each study."""
    PICTURES.mkdir(parents=True, exist_ok=True)
    for folder in folders:
        results = read_results(Path(folder))
        rows = [results.rows[number] for number in sorted(results.rows)]
        for name, unit in tables.measured(results).items():
            for number, plot in enumerate(plots_of(rows, tables.varied(results), name, unit)):
                path = PICTURES / f"{results.file.name}_{name}_{number}.svg"
                picture = Picture(name=path.stem, title="", caption="", svg=plot.svg)
                path.write_text(picture.as_file().replace("<style>", f"<style>{MORE}", 1), "utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
