"""Fixed-time plans: one file is one plan, found by its name, asked for with a `PlanRequest`.

A file holds `PLAN = Plan(about, cycle)`; `cycle` makes stages from a junction's program. The
timetable refuses a cycle that is not safe. To add a plan: copy `calm.py` and change it.
"""
