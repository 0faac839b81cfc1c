"""All outcomes of a trial as one table, with what chance leaves open."""

import math
from collections import Counter
from collections.abc import Callable, Iterable, Sequence

import numpy as np

from scm.mismatch.trial.again import Ratio
from scm.mismatch.trial.labels import Label
from scm.mismatch.trial.score import Outcome

NORMAL_95 = 1.959964
BARS = {
    "single": "exact 90, among 97", "pair": "among 75", "unlisted": "exact 80", "none": "exact 98",
    "shuffled": "exact 100", "other_car": "exact 100",
}  # fmt: skip
CLEAR = 2.0
NEAR = 1.15


def wilson(right: int, of: int) -> tuple[float, float]:
    """Return the 95 % interval of a share."""
    if of == 0:
        return 0.0, 1.0
    z2, share = NORMAL_95**2, right / of
    middle = (share + z2 / (2.0 * of)) / (1.0 + z2 / of)
    spread = NORMAL_95 * math.sqrt(share * (1.0 - share) / of + z2 / (4.0 * of * of))
    half = spread / (1.0 + z2 / of)
    return max(middle - half, 0.0), min(middle + half, 1.0)


def lines(outcomes: Sequence[Outcome], ratios: Sequence[Ratio]) -> list[str]:
    """Return the whole table as text."""
    head = f"{'concealed':<26}{'cases':>6}"
    for title in ("exact", "among", "missed", "false names"):
        head += f"{title:>22}"
    head += "   bar [%]"
    found = [head]
    for kind, bar in BARS.items():
        some = [outcome for outcome in outcomes if outcome.label.kind == kind]
        found += _row(kind, some, bar)
        clear = [o for o in some if o.label.strength and min(o.label.strength) >= CLEAR]
        if clear and len(clear) < len(some):
            found += _row(f"  of these, {CLEAR:g} x floor up", clear)
    found += ["", *_parameters(outcomes), *_again(ratios), *_times(outcomes)]
    found += ["", *_confusions(outcomes)]
    return found


def _row(title: str, outcomes: Sequence[Outcome], bar: str = "") -> list[str]:
    if not outcomes:
        return []
    tests: tuple[Callable[[Outcome], bool], ...] = (
        lambda o: o.exact, lambda o: o.among, lambda o: o.missed, lambda o: bool(o.false_names),
    )  # fmt: skip
    text = f"{title:<26}{len(outcomes):>6}"
    for test in tests:
        text += f"{_share(sum(map(test, outcomes)), len(outcomes)):>22}"
    return [f"{text}   {bar}".rstrip()]


def _share(right: int, of: int) -> str:
    low, high = wilson(right, of)
    return f"{100 * right / of:.0f} % ({100 * low:.0f} to {100 * high:.0f})"


def _parameters(outcomes: Iterable[Outcome]) -> list[str]:
    errors = [error for outcome in outcomes for error in outcome.errors]
    covered = [inside for outcome in outcomes for inside in outcome.covered]
    if not covered:
        return ["parameters: none found"]
    text = f"parameters: {len(covered)} found"
    if errors:
        middle, far = np.percentile(errors, (50, 90))
        text += f", error median {100 * middle:.1f} %, 90th percentile {100 * far:.0f} %"
    return [f"{text}; 90 % intervals hold the truth in {_share(sum(covered), len(covered))}"]


def _again(ratios: Sequence[Ratio]) -> list[str]:
    if not ratios:
        return []
    found = [f"another drive: {len(ratios)} cars whose effect shows in free runs; error over"]
    of_nominal = [ratio.found_m / ratio.nominal_m for ratio in ratios]
    text = f"  the nominal car's: median {np.median(of_nominal):.2f} (bar 0.25)"
    least = [r.true_m / r.nominal_m for r in ratios if r.true_m]
    if least:
        text += f"; the true car itself, beside the noise of poses: {np.median(least):.2f}"
    found.append(text)
    of_tuned = [ratio.found_m / ratio.retuned_m for ratio in ratios if ratio.retuned_m]
    if of_tuned:
        found.append(f"  the re-tuned car's: median {np.median(of_tuned):.2f}")
    of_true = [ratio.found_m / ratio.true_m for ratio in ratios if ratio.true_m]
    if of_true:
        near = _share(sum(ratio <= NEAR for ratio in of_true), len(of_true))
        found.append(f"  the true car's: median {np.median(of_true):.2f}, within {NEAR} in {near}")
        beyond = [_beyond(r.found_m, r.true_m) / _beyond(r.nominal_m, r.true_m)
                  for r in ratios if r.true_m and r.nominal_m > r.true_m]  # fmt: skip
        found.append(
            f"  the nominal car's, both beyond the true car's: median {np.median(beyond):.2f}"
        )
    of_discoveries = [r.found_m / r.nominal_m for r in ratios if r.true_m is None]
    if of_discoveries:
        half = _share(sum(ratio <= 0.5 for ratio in of_discoveries), len(of_discoveries))
        found.append(f"  the nominal car's, laws outside the library: at most half in {half}")
    return found


def _beyond(error_m: float, true_m: float) -> float:
    """Return what an error has beside the noise that the true car's has too."""
    return math.sqrt(max(error_m**2 - true_m**2, 0.0))


def _times(outcomes: Iterable[Outcome]) -> list[str]:
    times = [o.runtime_s for o in outcomes if math.isfinite(o.runtime_s)]
    if not times:
        return []
    return [f"time: median {np.median(times):.0f} s a case, longest {max(times):.0f} s"]


def _confusions(outcomes: Iterable[Outcome]) -> list[str]:
    counted = Counter((_true(o.label), _reported(o)) for o in outcomes if not o.exact)
    rows = [f"  {n} x  {true}  ->  {reported}" for (true, reported), n in counted.most_common()]
    return ["not exact: concealed -> reported", *rows] if rows else ["all exact"]


def each(outcomes: Iterable[Outcome]) -> list[str]:
    """Return one line a case."""
    found = []
    for outcome in outcomes:
        label = outcome.label
        sizes = " ".join(f"{strength:.1f}x" for strength in label.strength)
        mark = "exact" if outcome.exact else "among" if outcome.among else "wrong"
        found.append(
            f"{label.case}  {label.car:<8} {mark:<6} {_true(label)} {sizes} -> {_reported(outcome)}"
        )
    return found


def _true(label: Label) -> str:
    nothing = "nothing" if label.kind == "none" else label.kind.replace("_", " ")
    return " + ".join(label.names) or nothing


def _reported(outcome: Outcome) -> str:
    return outcome.failed or " + ".join(outcome.reported) or "nothing"
