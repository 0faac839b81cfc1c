"""Small studies for tests: a scenario that adds numbers, and an engine in this process."""

from dataclasses import dataclass

from scm.study.loaded_study import load

SCENARIO = '''"""Adds two numbers, and some luck."""

MAP = "driving_school"


def run(case, a=1.0, b=2.0, luck=0.1):
    return {"total": a + b + luck * case.generator("luck").normal()}
'''
STUDY = """
study = 1
title = "Adding"
scenario = "adds.py"
replications = 4
{more}

[factors]
a = [1.0, 2.0, 3.0]
{factors}

[measures.total]
unit = "1"
at_most = 4.5

{tables}
"""


def write(folder, *, more="", factors="", tables="", scenario=SCENARIO, name="adding"):
    """Write a study file and its scenario; return its path."""
    (folder / "adds.py").write_text(scenario)
    path = folder / f"{name}.toml"
    path.write_text(STUDY.format(more=more, factors=factors, tables=tables))
    return path


def loaded(folder, **parts):
    """Return a written study, loaded."""
    return load(write(folder, **parts))


@dataclass
class Here:
    """An engine that runs cases in this process, the last ones first."""

    study: object
    about: str = "here"
    cores: int = 1
    most: int = 1_000_000

    def run(self, tasks):
        """Yield rows; after `most` of them somebody presses Ctrl-C."""
        for task in reversed(list(tasks)):
            if self.most == 0:
                raise KeyboardInterrupt
            self.most -= 1
            yield self.study.run(task.case, task.values)
