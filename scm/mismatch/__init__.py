"""Where a simulation and a recording differ: what the simulator left out, in words and in numbers.

`pipeline` is a whole diagnosis, in this order: `usable_data` checks the recordings, `fit/` fits the
car's own parameters, `select/` adds effects of the `effect_catalogue`, `discovery/` looks for one
outside it, `validate/` tests the result on data that no fit has seen, `report/` writes it.
`findings` and `evidence` are what the report is made of; `budget` and `progress` limit and show the
time. `experiment/` designs the next drive, `several/` diagnoses several cars, `trial/` tests all of
it blind. May import replay, data_quality, vehicles, recording.
"""
