"""Training: a network learns what somebody did, from frames that are changed anew in every epoch.

Most frames of a drive steer hardly at all, so most of those are left out (balancing). The last lap
is held out: its loss shows what the network makes of frames that it has not seen.
Loss: mean squared error of the commands, -1 to 1. Optimiser: Adam, its rate falls as a cosine.
"""

import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace

import jax
import jax.numpy as jnp
import numpy as np
import optax

from scm.arrays import Bools, Floats, Image, Ints
from scm.camera.optics import optics_of
from scm.clock import NS_PER_S
from scm.errors import LearningError
from scm.vehicles.car import Car
from vehicle_agent.autonomy.plan import limits_of
from vehicle_agent.cloning.augmentation import Augmentation, Augmenter
from vehicle_agent.cloning.demonstration import Demonstration, Sample
from vehicle_agent.cloning.network import Convolution, FrameStack, Network

jax.config.update("jax_platforms", "cpu")  # networks this small learn no faster elsewhere

MOVING_MPS = 0.05  # slower frames teach nothing about steering
STRAIGHT, STRAIGHT_SHARE = 0.05, 0.2  # commands below; share of those that stays
FEWEST = 100  # frames
PARTS = 8  # of an epoch's frames, changed side by side
HELD_OUT = 0.2  # of the frames, where there is but one lap

Weights = list[tuple[jax.Array, jax.Array]]
"""Kernel and bias of each layer."""


@dataclass(frozen=True, slots=True)
class Recipe:
    """How a network is trained.

    Attributes:
        copies: How often each frame is changed in an epoch.
        rate: Of Adam, at first.
        dropout: Share of the units of dense layers that are silent in a step. The paper has 0.25:
            changed frames make that needless, and it keeps a small network from steering enough.
        outputs: `steering`, or `steering` and `throttle`.
        how: Of changing frames.
        delay_s: Of the servo that will obey: commands are learned from so much later.
        gain: Of the steering that will obey: commands are learned divided by it.
    """

    epochs: int = 10
    copies: int = 8
    batch: int = 256
    rate: float = 2e-3
    dropout: float = 0.0
    seed: int = 0
    outputs: tuple[str, ...] = ("steering",)
    how: Augmentation = field(default_factory=Augmentation)
    delay_s: float = 0.0
    gain: float = 1.0

    def fitted_to(self, car: Car) -> "Recipe":
        """Return this recipe for the delay and the gain of a car file's steering."""
        delay_s = car.value("steering.delay_s") if car.has("steering.delay_s") else 0.0
        gain = car.value("steering.gain") if car.has("steering.gain") else 1.0
        return replace(self, delay_s=delay_s, gain=gain)


@dataclass(frozen=True, slots=True)
class Progress:
    """One epoch: root mean squares of the commands' errors, on changed and on held-out frames."""

    epoch: int
    error: float
    held_out_error: float
    spent_s: float


@dataclass(frozen=True, slots=True)
class Trained:
    """A network that was trained.

    Attributes:
        weights: Kernel and bias of each layer, as `Network.shapes` says.
        history: Of the epochs.
        frames: How many were learned from, after balancing.
    """

    network: Network
    recipe: Recipe
    weights: list[tuple[Floats, Floats]]
    history: tuple[Progress, ...]
    frames: int


def balanced(steering: Floats, rng: np.random.Generator) -> Bools:
    """Return which frames stay (n,): all that steer, and some of the others."""
    stays: Bools = (np.abs(steering) >= STRAIGHT) | (rng.random(len(steering)) < STRAIGHT_SHARE)
    return stays


def train(
    demonstrations: list[Demonstration], network: Network, car: Car, recipe: Recipe,
    on_epoch: Callable[[Progress], None] | None = None,
) -> Trained:  # fmt: skip
    """Train a network.

    Args:
        demonstrations: Of one kind of car.
        network: What is trained.
        recipe: How.
        on_epoch: Called after each.
        car: The file of that car: its camera and its wheels say how changed frames look.

    Raises:
        LearningError: when there is too little to learn from.
        CarError: when the car file lacks a camera.
    """
    began_s = time.monotonic()
    rng = np.random.default_rng(recipe.seed)
    frames, stacks, commands, is_held = _read(demonstrations, network.stack, recipe)
    is_used = ~is_held & balanced(commands[:, 0], rng)
    if is_used.sum() < FEWEST:
        msg = f"expected {FEWEST} frames or more to learn from, got {is_used.sum()}"
        raise LearningError(f"{msg}, after balancing: drive more laps")
    used = np.flatnonzero(is_used)
    size = frames[0].shape[1], frames[0].shape[0]
    optics, limits = optics_of(car, "front"), limits_of(car)
    augmenters = [Augmenter(optics, limits, size, recipe.how, one) for one in rng.spawn(PARTS)]
    held = [network.view([frames[at] for at in stacks[one]]) for one in np.flatnonzero(is_held)]
    fit = _Fit(network, recipe, len(used) * recipe.copies)
    history = []
    for epoch in range(recipe.epochs):
        chosen = np.tile(used, recipe.copies)
        seen = [[frames[at] for at in stacks[one]] for one in chosen]
        images, targets = _changed(network, augmenters, seen, commands[chosen])
        error = fit.epoch(images, _for_car(targets, recipe), rng)
        held_error = fit.error(np.array(held), _for_car(commands[is_held], recipe))
        history.append(Progress(epoch, error, held_error, time.monotonic() - began_s))
        if on_epoch is not None:
            on_epoch(history[-1])
    return Trained(network, recipe, fit.numbers(), tuple(history), len(used))


def _read(
    demonstrations: list[Demonstration], stack: int, recipe: Recipe
) -> tuple[list[Image], list[list[int]], Floats, Bools]:
    """Read the frames of moving cars.

    Returns:
        The frames; for each the numbers of those that are seen with it, newest first; the
        commands (n, outputs); which frames are held out (n,).

    Raises:
        LearningError: when a frame is missing, or has another size than the others.
    """
    frames: list[Image] = []
    stacks, commands, is_held = list[list[int]](), list[Floats](), list[bool]()
    for one in demonstrations:
        seen = FrameStack[int](stack)
        moving = [sample for sample in one.samples if abs(sample.speed_mps) > MOVING_MPS]
        last = max((sample.lap for sample in moving), default=0)
        first_held = len(moving) - round(HELD_OUT * len(moving))
        for number, sample in enumerate(moving):
            stacks.append(seen.add(sample.t_ns, len(frames)))
            frames.append(one.frame(sample))
            is_held.append(sample.lap == last if last else number >= first_held)
            if frames[-1].shape != frames[0].shape:
                expected, got = frames[0].shape[1::-1], frames[-1].shape[1::-1]
                msg = f"{one.path}: {sample.frame}: expected a frame of {expected} px, got {got}"
                raise LearningError(msg)
        commands.append(_commands(one, moving, recipe))
    return frames, stacks, np.concatenate(commands), np.array(is_held, dtype=np.bool_)


def _commands(one: Demonstration, moving: list[Sample], recipe: Recipe) -> Floats:
    """Return the commands of frames (n, outputs); a servo that obeys late gets later steering."""
    at_s = one.column("arrived_ns") / NS_PER_S
    wanted_s = np.array([sample.arrived_ns for sample in moving]) / NS_PER_S
    delays_s = {"steering": recipe.delay_s, "throttle": 0.0}
    return np.column_stack([
        np.interp(wanted_s + delays_s[name], at_s, one.column(name)) for name in recipe.outputs
    ])  # fmt: skip


def _for_car(commands: Floats, recipe: Recipe) -> Floats:
    """Return commands (n, outputs) for the car that will obey."""
    gains = np.array([recipe.gain, 1.0])[: commands.shape[1]]
    clipped: Floats = np.clip(commands / gains, -1.0, 1.0)
    return clipped


def _changed(
    network: Network, augmenters: list[Augmenter], seen: list[list[Image]], commands: Floats
) -> tuple[Image, Floats]:
    """Return inputs (n, h, w, channels) and commands (n, outputs), each frame changed anew."""
    size = network.height_px, network.width_px, network.channels
    images, targets = np.empty((len(seen), *size), np.uint8), commands.copy()

    def change(augment: Augmenter, rows: Ints) -> None:
        for row in rows:
            changed, targets[row, 0] = augment(seen[row], float(targets[row, 0]))
            images[row] = network.view(changed)

    with ThreadPoolExecutor() as pool:  # OpenCV works outside Python's lock
        parts = np.array_split(np.arange(len(seen)), len(augmenters))
        list(pool.map(change, augmenters, parts))
    return images, targets


class _Fit:
    """The weights while they are learned."""

    def __init__(self, network: Network, recipe: Recipe, samples: int) -> None:
        self._recipe = recipe
        steps = max(1, samples // recipe.batch) * recipe.epochs
        self._optimiser = optax.adam(optax.cosine_decay_schedule(recipe.rate, steps))
        key = jax.random.key(recipe.seed)
        self._key, first = jax.random.split(key)
        self._weights = initial(network, len(recipe.outputs), first)
        self._state = self._optimiser.init(self._weights)

        def loss(
            weights: Weights, images: jax.Array, targets: jax.Array, key: jax.Array
        ) -> jax.Array:
            return jnp.mean(
                (outputs_of(network, weights, images, recipe.dropout, key) - targets) ** 2
            )

        def step(
            weights: Weights, state: optax.OptState, images: jax.Array, targets: jax.Array,
            key: jax.Array,
        ) -> tuple[Weights, optax.OptState, jax.Array]:  # fmt: skip
            value, slope = jax.value_and_grad(loss)(weights, images, targets, key)
            change, state = self._optimiser.update(slope, state)
            return optax.apply_updates(weights, change), state, value

        self._step = jax.jit(step)
        self._outputs = jax.jit(lambda weights, images: outputs_of(network, weights, images))

    def epoch(self, images: Image, targets: Floats, rng: np.random.Generator) -> float:
        """Learn from all samples once; return the root mean square of the error.

        Raises:
            LearningError: when it is no number any more.
        """
        size = min(self._recipe.batch, len(images))
        order = rng.permutation(len(images))[: len(images) // size * size]
        squares = []
        for batch in order.reshape(-1, size):
            self._key, key = jax.random.split(self._key)
            self._weights, self._state, value = self._step(
                self._weights, self._state, images[batch], targets[batch], key
            )
            squares.append(value)
        error = float(np.sqrt(np.mean(np.array(squares))))
        if not np.isfinite(error):
            raise LearningError(
                f"the loss is {error}: try a lower --rate than {self._recipe.rate:g}"
            )
        return error

    def error(self, images: Image, targets: Floats) -> float:
        """Return the root mean square of the error on frames as they are; NaN without any."""
        if not len(images):
            return float("nan")
        size = self._recipe.batch
        parts = [
            np.asarray(self._outputs(self._weights, images[first : first + size]))
            for first in range(0, len(images), size)
        ]
        return float(np.sqrt(np.mean((np.concatenate(parts) - targets) ** 2)))

    def numbers(self) -> list[tuple[Floats, Floats]]:
        """Return the weights as arrays of NumPy."""
        return [(np.asarray(kernel), np.asarray(bias)) for kernel, bias in self._weights]


def initial(network: Network, outputs: int, key: jax.Array) -> Weights:
    """Return random weights by He's rule."""
    shapes = network.shapes(outputs)
    keys = jax.random.split(key, len(shapes))
    return [
        (jax.random.normal(one, shape) * (2.0 / np.prod(shape[:-1])) ** 0.5, jnp.zeros(shape[-1]))
        for one, shape in zip(keys, shapes, strict=True)
    ]


def outputs_of(
    network: Network,
    weights: Weights,
    images: jax.Array,
    dropout: float = 0.0,
    key: jax.Array | None = None,
) -> jax.Array:
    """Return commands (n, outputs) for inputs (n, h, w, 3), 0 to 255; a key silences units."""
    values = images.astype(jnp.float32) / 255.0 - 0.5
    layers = [*network.layers, None]
    for number, ((kernel, bias), layer) in enumerate(zip(weights, layers, strict=True)):
        if isinstance(layer, Convolution):
            values = jax.nn.relu(_convolved(values, kernel, layer.step_px) + bias)
            continue
        values = values.reshape(len(values), -1) @ kernel + bias
        if layer is None:
            continue
        values = jax.nn.relu(values)
        if key is not None and dropout:
            stays = jax.random.bernoulli(
                jax.random.fold_in(key, number), 1.0 - dropout, values.shape
            )
            values = jnp.where(stays, values / (1.0 - dropout), 0.0)
    return values


def _convolved(values: jax.Array, kernel: jax.Array, step_px: int) -> jax.Array:
    """Return (n, h, w, out) of (n, h, w, in) and a kernel (k, k, in, out), without padding.

    Short steps go by a product of matrices: with its gradient, that takes 0.6 of the time of XLA's
    own convolution on a CPU (`pilotnet`, `linear`). At a step of 5, XLA's takes half of it.
    """
    if step_px > 2:
        layout = ("NHWC", "HWIO", "NHWC")
        return jax.lax.conv_general_dilated(
            values, kernel, (step_px, step_px), "VALID", dimension_numbers=layout
        )
    size_px, _, channels, outputs = kernel.shape
    count, *size, _ = values.shape
    height, width = ((one - size_px) // step_px + 1 for one in size)
    columns = [
        values[
            :, row : row + step_px * height : step_px, column : column + step_px * width : step_px
        ]
        for row in range(size_px)
        for column in range(size_px)
    ]
    patches = jnp.concatenate(columns, axis=-1).reshape(-1, size_px**2 * channels)
    product = patches @ kernel.reshape(-1, outputs)
    return product.reshape(count, height, width, outputs)
