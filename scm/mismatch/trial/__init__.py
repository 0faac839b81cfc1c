"""Blind trials: effects concealed in a reality that is not ours, diagnosed, then labels opened.

`run` has the cases made and diagnosed without labels, `labels` holds what was concealed and checks
its seals, `score` judges one case and all together, `again` a patched car on another drive. May
import all of `mismatch`, but for `tests/reality` only as a program of its own.
"""
