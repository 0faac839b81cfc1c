"""Processes that have loaded the compiler and compiled nothing, to compile cars in.

Each is a fork of one process that has only imported: loading takes as long as a small car's kernel.
"""

import os
import sys
from importlib import import_module
from multiprocessing import get_context
from pathlib import Path

FRESH = get_context("forkserver")
FRESH.set_forkserver_preload(["scm.vehicles.fleet", "scm.vehicles.compiler.kernel_file"])
LONGEST_S = 120.0


class Compiling:
    """A process of its own that calls `work(*arguments)` with a cache folder; it begins at once."""

    def __init__(self, work, cache, *arguments):
        self._ours, theirs = FRESH.Pipe(duplex=False)
        self._process = FRESH.Process(target=_answer, args=(theirs, work, cache, arguments))
        self._process.start()
        theirs.close()

    def result(self):
        """Wait for what the work returned."""
        assert self._ours.poll(LONGEST_S), "it takes too long"
        answer = self._ours.recv()
        self._process.join(LONGEST_S)
        assert self._process.exitcode == 0
        self._process.close()
        self._ours.close()
        return answer


def _answer(to, work, cache, arguments):
    os.environ["SCM_CACHE_DIR"] = str(cache)
    sys.dont_write_bytecode = True
    to.send(work(*arguments))
    to.close()


def small_kernel(folder, calm_after=None):
    """Return the module name of a small car's kernel with the law of `folder/calm.py`.

    That file is given the text `calm_after` once it is loaded.
    """
    from scm.vehicles.car import all_terms
    from scm.vehicles.compiler.kernel_file import compile_kernel
    from scm.vehicles.physics_variables import Per
    from scm.vehicles.term import Term

    sys.path.insert(0, str(folder))
    calm = import_module("calm").calm
    if calm_after is not None:
        Path(folder, "calm.py").write_text(calm_after, encoding="utf-8")
    names = ("suspension_spring", "tyre_contact")
    terms = [*(all_terms()[name] for name in names), Term(calm, per=Per.BODY, adds="force_x")]
    return compile_kernel(terms).__name__


def small_car_after_a_second():
    """Return where a car of few effects is after a second of full throttle, to the last bit."""
    from dataclasses import replace

    from scm.geometry import Pose2
    from scm.vehicles.car import all_terms, load_car
    from scm.vehicles.fleet import Fleet

    few = ("suspension_spring", "tyre_contact", "tyre_longitudinal", "motor_dc")
    car = replace(load_car("nigel"), terms=tuple(all_terms()[name] for name in few))
    fleet = Fleet(car, 1)
    fleet.throttle[fleet.add(Pose2(0.0, 0.0, 0.0))] = 1.0
    fleet.advance(1.0)
    return float(fleet.x[0]).hex()
