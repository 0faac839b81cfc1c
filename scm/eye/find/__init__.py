"""Finding tags frame after frame: known ones measured where they should be, the rest by strips."""
