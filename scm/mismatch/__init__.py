"""Where a simulation and a recording differ: what the simulator left out, in words and in numbers.

`pipeline` is the whole diagnosis: `usable_data` checks recordings, `fit/` drives them again in
batches and fits the car's own numbers, `select/` tries the effects of `effect_catalogue`,
`discovery/` those of no catalogue, `validate/` judges what was found by free runs. `findings` and
`evidence` are what comes out, `report/` shows it.
"""
