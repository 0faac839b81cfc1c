"""Live trials: cars of a reality that is not ours change in a running city; does the twin see it?

`run` has scenes drawn and sealed, cities played, labels opened; `city` plays one in lockstep, with
`poses_eye` as its cameras; `score` judges what the city found, by the labels. The reality,
`tests/reality`, is known by its drawings and its bodies only.
"""
