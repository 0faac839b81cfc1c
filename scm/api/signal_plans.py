"""Signal plans that people made: a folder a junction, a file a plan, each with its proof.

A plan is proven by another process, `scm plan prove`: the search would keep the server from its
pages. What was proven is remembered by its digest, so exactly that may be saved.
"""

import re
import subprocess
import sys
import threading
from collections import OrderedDict
from pathlib import Path

import msgspec

from scm.api.operations import ProgressReporter
from scm.api.problem import RefusedError
from scm.errors import PlanError
from scm.records.signal_plans import PlanProof
from scm.runtime.priority import stand_back
from scm.v2x.plan_file import PlanFile

MOST_PLANS = 50
PLAN_NAME = re.compile(r"[a-z][a-z0-9_-]{0,31}")
MAX_PROOFS = 200
LOOK_S = 0.2


class PlanRepository:
    """The plans of all junctions; safe from any thread.

    Attributes:
        folder: Where they lie; None: nothing can be saved.
        editing: Held from reading a plan to changing it: the second of two writers is refused.
    """

    def __init__(self, folder: Path | None) -> None:
        self.folder = folder
        self.editing = threading.Lock()
        self._lock = threading.Lock()
        self._proofs: OrderedDict[str, PlanProof] = OrderedDict()

    def names(self, junction: str) -> list[str]:
        """Return the names of a junction's saved plans."""
        if self.folder is None:
            return []
        return sorted(path.stem for path in (self.folder / junction).glob("*.json"))

    def read(self, junction: str, plan: str) -> PlanFile | None:
        """Return a saved plan; None: there is none.

        Raises:
            RefusedError: when its file cannot be read.
        """
        path = self._path(junction, plan)
        if path is None or not path.is_file():
            return None
        try:
            return msgspec.json.decode(path.read_bytes(), type=PlanFile)
        except (OSError, msgspec.MsgspecError) as cause:
            detail = f"plan file {path.name} of {junction}: {cause}"
            raise RefusedError.of("unreadable", detail) from cause

    def write(self, file: PlanFile) -> None:
        """Save a plan.

        Raises:
            PlanError: when the city keeps no plans, or this junction has too many.
        """
        path = self._path(file.junction, file.plan)
        if path is None:
            raise PlanError("plans: this city keeps none; start `scm api` with --data FOLDER")
        names = self.names(file.junction)
        if file.plan not in names and len(names) >= MOST_PLANS:
            raise PlanError(f"plans of {file.junction}: {len(names)}, delete one first")
        path.parent.mkdir(parents=True, exist_ok=True)
        whole = path.with_suffix(".part")
        whole.write_bytes(msgspec.json.format(msgspec.json.encode(file), indent=2))
        whole.replace(path)

    def delete(self, junction: str, plan: str) -> None:
        """Forget a saved plan."""
        path = self._path(junction, plan)
        if path is not None:
            path.unlink(missing_ok=True)

    def proof_of(self, digest: str) -> PlanProof | None:
        """Return the proof of exactly that; None: there is none, or it was forgotten."""
        with self._lock:
            return self._proofs.get(digest)

    def prove(self, file: PlanFile, progress: ProgressReporter) -> str:
        """Run the search in a process of its own; return the address of the proof.

        Raises:
            PlanError: when a stage or time is not valid.
            Cancelled: when it was called off.
        """
        progress("walks through every state of kernel and plan")
        found = _search(file, progress)
        with self._lock:
            self._proofs[found.digest] = found
            while len(self._proofs) > MAX_PROOFS:
                self._proofs.popitem(last=False)
        return f"/api/v1/signals/{file.junction}/proofs/{found.digest}"

    def _path(self, junction: str, plan: str) -> Path | None:
        """Return where a plan lies; None: nowhere, for that is no name of one."""
        if self.folder is None or not PLAN_NAME.fullmatch(plan):
            return None
        return self.folder / junction / f"{plan}.json"


def _search(file: PlanFile, progress: ProgressReporter) -> PlanProof:
    command = [sys.executable, "-m", "scm", "plan", "prove", "-"]
    pipe = subprocess.PIPE
    given: bytes | None = msgspec.json.encode(file)
    with subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=pipe) as process:
        stand_back(process.pid)
        try:
            while True:
                try:
                    out, error_text = process.communicate(given, timeout=LOOK_S)
                    break
                except subprocess.TimeoutExpired:
                    given = None
                    progress("walks through every state of kernel and plan")
        except BaseException:
            process.kill()
            raise
    if process.returncode != 0:
        words = error_text.decode("utf-8", "replace").strip().splitlines()
        raise PlanError(words[-1] if words else "the search ended without a word")
    return msgspec.json.decode(out, type=PlanProof)
