"""What the Eye finds, how exactly and how soon, beside the AprilTag library and OpenCV's detector.

The finder alone (`eye_find`), then the whole Eye on films with known truth (`eye_live`).
`python -m bench.eye_wrong_ids` looks for tags where there are none, for minutes.
"""

from bench import eye_find, eye_live


def main() -> None:
    """Print both."""
    eye_find.main()
    print()
    eye_live.main()


if __name__ == "__main__":
    main()
