"""Operations on studies of a city.

Written by docs/make/client.py: do not change it here.
"""

from scm.client.operation import Noun, operation
from scm.records.page import Page
from scm.records.studies import Study, StudyRow


class StudiesNoun(Noun):
    """Operations on studies."""

    @operation("GET", "/api/v1/studies")
    def all_studies(self, *, limit: int = 100, cursor: str = "") -> Page[StudyRow]:
        """All studies, the one begun last first."""

    @operation("GET", "/api/v1/studies/{name}")
    def one_study(self, name: str) -> Study:
        """One study and what came of it.

        Args:
            name: a study: its folder in `studies`
        """

    @operation("GET", "/api/v1/studies/{name}/page")
    def page(self, name: str) -> bytes:
        """A study as one page with plots.

        Args:
            name: a study: its folder in `studies`
        """
