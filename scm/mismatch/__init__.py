"""Where a simulation and a recording differ: what the simulator left out, in words and in numbers.

`drive` holds a recording, `doubt` its sensors against each other; `rollouts` drive it again in
batches of parameter sets, `predict` turns them into measurements, `whiten` weighs the rest.
`listed` knows the effects, `search` tries them, `judge` holds them against unseen parts.
`findings` is what comes out, `report` shows it.
"""
