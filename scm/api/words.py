"""What a field of the interface means, by its name: one name, one meaning, wherever it stands.

A record that means something more special says so below `Attributes:` in its docstring, which
comes first. The examples are those of one moment in the driving school.
"""

WORDS: dict[str, tuple[str, object]] = {
    "name": ("What it is called in the city.", "crossing"),
}

UNITS: dict[str, float | int] = {
    "m": 1.25, "s": 2.5, "ms": 12.5, "ns": 120_000_000_000, "mps": 0.3, "mps2": 0.5, "rad": 0.1,
    "radps": 0.2, "deg": 0.4, "mm": 1.8, "px": 640, "hz": 20.0, "nm": 0.01, "v": 7.4,
}  # fmt: skip
"""An example for a number that ends in this unit."""
