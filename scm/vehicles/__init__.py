"""Cars: physical effects as terms, assembled into one compiled kernel, advanced as a fleet.

`physics_variables`, `param`, `term` are the vocabulary; `terms/` holds the effects, `body14` the
skeleton; `compiler/` makes a car's kernel (see its README); `jit` is the only door to numba, and
`cold_start` compiles what a first start needs. `car` reads `types/<car>.toml`; `fleet` runs cars.
`drivers/` steer them, `guard` stands between commands and actuators, `sensors/` measure.
May import everything below `vehicles`; no bus, camera or web. To add a car: a file in `types/`.
"""
