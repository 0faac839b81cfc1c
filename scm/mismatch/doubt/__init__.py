"""Sensors against each other, before any physics is blamed: what the data itself gets wrong.

`doubt` asks every question of a recording; `rows`, `stuck`, `driven` and `other_car` look at the
file, `clocks` and `gross` at what spoils everything else, `turning`, `travel`, `pushing` and
`sideways` compare two sensors each through `whitened`; `suspect` says which fault would explain it.
"""
