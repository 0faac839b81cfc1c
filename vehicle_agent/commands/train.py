"""`vehicle-agent train`: let a network learn from demonstrations."""

import argparse
from dataclasses import replace
from pathlib import Path

from scm.command import Command


def _arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "demonstrations", nargs="+", type=Path, metavar="DIR", help="folders by record-demo"
    )
    parser.add_argument(
        "--model", default="paper", metavar="NETWORK",
        help="paper, pilotnet, or linear as Donkey Car's (%(default)s)",
    )  # fmt: skip
    parser.add_argument(
        "--out", type=Path, default=Path("model.onnx"), metavar="FILE",
        help="the trained network (%(default)s)",
    )  # fmt: skip
    parser.add_argument("--throttle", action="store_true", help="learn the throttle as well")
    parser.add_argument(
        "--frames", type=int, default=1,
        help="how many it sees at once, 0.2 s apart (%(default)s)",
    )  # fmt: skip
    parser.add_argument(
        "--for", dest="car", metavar="CAR",
        help="the car that will drive, by name or file: its steering's delay and gain count",
    )  # fmt: skip
    parser.add_argument("--epochs", type=int, default=10, help="(%(default)s)")
    parser.add_argument("--rate", type=float, default=2e-3, help="of learning (%(default)s)")
    parser.add_argument("--seed", type=int, default=0, help="of all that is drawn (%(default)s)")


def _run(arguments: argparse.Namespace) -> int:
    from scm.errors import LearningError, RunError
    from scm.vehicles.car import load_car
    from vehicle_agent.cloning.network import network_named

    network = replace(network_named(arguments.model), stack=arguments.frames)
    for name in ("epochs", "rate", "frames"):
        if getattr(arguments, name) <= 0:
            raise LearningError(f"--{name}: expected more than 0, got {getattr(arguments, name)}")
    if not arguments.out.absolute().parent.is_dir():
        raise LearningError(f"--out {arguments.out}: expected a folder that exists")
    try:
        from vehicle_agent.cloning.learning import learn
        from vehicle_agent.cloning.training import Progress, Recipe
    except ModuleNotFoundError as cause:
        msg = f"{cause.name} is not installed: pip install 'scm[learn]'"
        raise RunError(msg) from cause

    def show(progress: Progress) -> None:
        held = progress.held_out_error
        print(
            f"epoch {progress.epoch + 1} of {arguments.epochs}: error {progress.error:.3f}, on the "
            f"lap held out {held:.3f}, {progress.spent_s:.0f} s",
            flush=True,
        )

    outputs = ("steering", "throttle") if arguments.throttle else ("steering",)
    recipe = Recipe(
        epochs=arguments.epochs, rate=arguments.rate, seed=arguments.seed, outputs=outputs
    )
    if arguments.car is not None:
        recipe = recipe.fitted_to(load_car(arguments.car))
    metadata = learn(arguments.demonstrations, network, recipe, arguments.out, show)
    print(
        f"{arguments.out}: {network.parameters(len(outputs))} parameters, learned from "
        f"{metadata.frames} frames of {metadata.laps} laps: vehicle-agent drive {arguments.out} ..."
    )
    return 0


COMMAND = Command(
    help="let a network learn to steer from demonstrations",
    example="vehicle-agent train demos/mine --model paper --out model.onnx",
    arguments=_arguments,
    run=_run,
)
