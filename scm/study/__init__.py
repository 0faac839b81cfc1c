"""Studies: one scenario in many lockstep cities, over factors and seeds, and what came of it.

    study_file -> design (values of every case) -> engines (case processes) -> results -> show

A case is (study, number). `targets.py` says what a factor may vary, `case.py` is what a scenario
gets, `case_process.py` runs cases away from everything else.
"""
