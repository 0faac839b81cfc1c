"""Traffic signals: kernel, policies and plans of every junction, and the part that publishes them.

`kernel.py` alone decides colours, `proof/` proves it; `policies/` request green through `rings.py`
or the timetables of `plans/`; `controller.py` runs them and keeps guaranteed times,
`detectors.py` finds cars, `part.py` connects junctions to the city.
To add a policy or a plan: one file in `policies/` or `plans/`.
"""
