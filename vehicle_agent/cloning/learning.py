"""From the folders of demonstrations to the file of a trained network, with its metadata."""

import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

from scm import __version__
from scm.arrays import Floats
from scm.errors import LearningError
from scm.vehicles.car import load_car
from vehicle_agent.cloning.demonstration import SAMPLES, Demonstration
from vehicle_agent.cloning.model_file import INPUT, KEY, OUTPUT, Metadata
from vehicle_agent.cloning.network import Convolution, Network
from vehicle_agent.cloning.training import MOVING_MPS, Progress, Recipe, train

OPSET, IR_VERSION = 17, 9  # old enough for the runtimes of small computers


def learn(
    paths: list[Path], network: Network, recipe: Recipe, out: Path,
    on_epoch: Callable[[Progress], None] | None = None,
) -> Metadata:  # fmt: skip
    """Train a network on demonstrations, and write it.

    Raises:
        LearningError: when a demonstration is damaged, or they are of different cars.
        CarError: when their car has no camera.
    """
    demonstrations = [Demonstration(path) for path in paths]
    cars = sorted({one.about.car for one in demonstrations})
    if len(cars) > 1:
        raise LearningError(f"expected demonstrations of one car, got {' and '.join(cars)}")
    trained = train(demonstrations, network, load_car(cars[0]), recipe, on_epoch)
    throttles = np.concatenate([
        one.column("throttle")[np.abs(one.column("speed_mps")) > MOVING_MPS]
        for one in demonstrations
    ])  # fmt: skip
    last = trained.history[-1]
    metadata = Metadata(
        model=1, network=network.name, outputs=recipe.outputs, car=cars[0],
        map=" ".join(sorted({one.about.map for one in demonstrations})),
        throttle=float(np.median(throttles)),
        delay_s=max(one.about.delay_s for one in demonstrations),
        frames=trained.frames, laps=sum(one.about.laps for one in demonstrations),
        epochs=recipe.epochs, seed=recipe.seed, error=last.error,
        held_out_error=None if np.isnan(last.held_out_error) else last.held_out_error,
        data_sha256=_hash(paths), scm=__version__, stack=network.stack,
        steering_delay_s=recipe.delay_s, steering_gain=recipe.gain,
    )  # fmt: skip
    write(out, network, trained.weights, metadata)
    return metadata


def _hash(paths: list[Path]) -> str:
    """Return a hash of all samples."""
    digest = hashlib.sha256()
    for path in paths:
        digest.update((path / SAMPLES).read_bytes())
    return digest.hexdigest()


def write(
    path: Path, network: Network, weights: list[tuple[Floats, Floats]], metadata: Metadata
) -> None:
    """Write a network with its metadata.

    Raises:
        LearningError: when the file cannot be written.
    """
    graph = _Graph()
    output = graph.layers(network, weights)
    graph.nodes.append(helper.make_node("Identity", [output], [OUTPUT]))
    size = [1, network.height_px, network.width_px, network.channels]
    made = helper.make_graph(
        graph.nodes, network.name,
        [helper.make_tensor_value_info(INPUT, TensorProto.UINT8, size)],
        [helper.make_tensor_value_info(OUTPUT, TensorProto.FLOAT, [1, len(metadata.outputs)])],
        graph.numbers,
    )  # fmt: skip
    opset = [helper.make_opsetid("", OPSET)]
    model = helper.make_model(made, opset_imports=opset, ir_version=IR_VERSION)
    helper.set_model_props(model, {KEY: msgspec.json.encode(metadata).decode()})
    onnx.checker.check_model(model)
    try:
        path.write_bytes(model.SerializeToString())
    except OSError as cause:
        raise LearningError(f"{path}: cannot be written: {cause.strerror}") from cause


class _Graph:
    """An ONNX graph in the making: its nodes, and the numbers that they use."""

    def __init__(self) -> None:
        self.nodes: list[onnx.NodeProto] = []
        self.numbers: list[onnx.TensorProto] = []

    def layers(self, network: Network, weights: list[tuple[Floats, Floats]]) -> str:
        """Add all from a picture to the commands; return the name of the last output."""
        value = self._add("Cast", INPUT, to=TensorProto.FLOAT)
        value = self._add("Mul", value, self._number(1.0 / 255.0))
        value = self._add("Sub", value, self._number(0.5))
        value = self._add("Transpose", value, perm=[0, 3, 1, 2])  # ONNX has colours before rows
        is_flat = False
        for (kernel, bias), layer in zip(weights, (*network.layers, None), strict=True):
            if isinstance(layer, Convolution):
                numbers = self._number(kernel.transpose(3, 2, 0, 1)), self._number(bias)
                value = self._add("Conv", value, *numbers, strides=[layer.step_px] * 2)
            else:
                if not is_flat:
                    value = self._add("Flatten", self._add("Transpose", value, perm=[0, 2, 3, 1]))
                    is_flat = True
                value = self._add("Gemm", value, self._number(kernel), self._number(bias))
            if layer is not None:
                value = self._add("Relu", value)
        return value

    def _add(self, kind: str, *inputs: str, **attributes: Any) -> str:
        name = f"{kind.lower()}_{len(self.nodes)}"
        self.nodes.append(helper.make_node(kind, inputs, [name], **attributes))
        return name

    def _number(self, values: Floats | float) -> str:
        name = f"number_{len(self.numbers)}"
        self.numbers.append(numpy_helper.from_array(np.asarray(values, np.float32), name))
        return name
