"""What the Eye finds, how exactly and how soon, beside the AprilTag library and OpenCV's detector.

The finder alone (`eye_find`), then the whole Eye on films with known truth (`eye_live`), as a
process over the bus (`eye_soon`), and what the finder's memory grows by (`eye_memory`).
`python -m bench.eye_wrong_ids` looks for tags where there are none, for minutes.
"""

from bench import eye_find, eye_live, eye_memory, eye_soon


def main() -> None:
    """Print all four."""
    eye_find.main()
    print()
    eye_live.main()
    print()
    eye_soon.main()
    print()
    eye_memory.main()


if __name__ == "__main__":
    main()
