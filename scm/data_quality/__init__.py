"""Sensors against each other, before any physics is blamed: what the data itself gets wrong.

`check` asks every question of a recording. `rows`, `stuck`, `driven` and `other_car` look at the
file; `gross`, `clocks` and `mend*` at what spoils everything else, which `corrected` undoes;
`turning`, `travel`, `pushing` and `sideways` compare two sensors each, on a `track` and through
`whitened`; `suspect` says which fault would explain it. May import recording, vehicles.
"""
