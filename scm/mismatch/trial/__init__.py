"""Blind trials: effects concealed in a reality that is not ours, diagnosed, then labels opened.

`reality` has the cases made, `labels` holds what was concealed and checks its seals,
`blind` diagnoses without labels, `score` judges one case, `again` its patched car on another
drive, `table` all cases together. May import all of `mismatch`, but for `tests/reality` only as
a program of its own.
"""
