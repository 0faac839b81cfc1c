"""Makes one compiled kernel of a car's list of terms; README.md shows one term on its way."""
