"""Sensors against each other, before any physics is blamed: what the data itself gets wrong.

`prepare` is the one door: it screens rows (`screen`: `stamps`, `spikes`, `counters`, by the car's
`limits`), asks every question (`check`), undoes gross faults (`corrected`) and cuts (`stretches`).
`rows`, `stuck`, `driven` and `other_car` look at the file; `gross`, `clocks` and `mend*` at what
spoils everything else; `turning`, `travel`, `pushing` and `sideways` compare two sensors each, on
a `track` and through `whitened`; `suspect` says which fault would explain it. May import recording,
vehicles.
"""
