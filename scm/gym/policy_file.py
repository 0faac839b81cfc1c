"""Trained policies as ONNX files that `vehicle-agent drive` can use.

    input   observation   float32 (1, columns), as the environment gives it
    output  action        float32 (1, 2), as the environment takes it; beyond its range: clipped

What scales observations or actions belongs into the network. Write needs `onnx`.
"""

from collections.abc import Sequence
from pathlib import Path

import msgspec
import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

import scm
from scm.arrays import Floats
from scm.errors import LearningError
from scm.gym.observations import Observations
from scm.gym.parallel import CityParallelEnv
from scm.gym.vector import CityVectorEnv
from scm.records.policy import INPUT, OUTPUT, POLICY_KEY, PolicyMetadata

OPSET, IR_VERSION = 17, 8


def write_policy(
    path: Path, layers: Sequence[tuple[Floats, Floats]], mean: Floats, spread: Floats,
    env: CityVectorEnv | CityParallelEnv, clip: float = 10.0,
) -> None:  # fmt: skip
    """Write a network of dense layers with hyperbolic tangents between them.

    Args:
        path: Of the file.
        layers: Weights (inputs, outputs) and biases (outputs,) of each.
        mean: Of the observations, (columns,).
        spread: Their standard deviations, (columns,).
        env: That it was trained in.
        clip: Most that a scaled observation is taken for.

    Raises:
        LearningError: The task's actions are choices by number, which no car's program can take.
    """
    columns = len(mean)
    shown = {"mean": mean[None], "spread": spread[None]}
    limits = {"low": np.array(-clip), "high": np.array(clip)}
    nodes = [
        helper.make_node("Sub", [INPUT, "mean"], ["centred"]),
        helper.make_node("Div", ["centred", "spread"], ["scaled"]),
        helper.make_node("Clip", ["scaled", "low", "high"], ["clipped"]),
    ]
    at = "clipped"
    for k, (weights, bias) in enumerate(layers):
        shown |= {f"weights_{k}": weights, f"bias_{k}": bias}
        is_last = k == len(layers) - 1
        out = OUTPUT if is_last else f"sum_{k}"
        nodes.append(helper.make_node("Gemm", [at, f"weights_{k}", f"bias_{k}"], [out]))
        if not is_last:
            at = f"layer_{k}"
            nodes.append(helper.make_node("Tanh", [out], [at]))
    constants = [
        numpy_helper.from_array(np.asarray(value, np.float32), name)
        for name, value in {**shown, **limits}.items()
    ]
    seen, action = (
        [helper.make_tensor_value_info(name, TensorProto.FLOAT, [1, width])]
        for name, width in ((INPUT, columns), (OUTPUT, 2))
    )
    graph = helper.make_graph(nodes, "policy", seen, action, constants)
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", OPSET)])
    model.ir_version = IR_VERSION
    onnx.checker.check_model(model)
    _save(model, path, env)


def describe_policy(path: Path, env: CityVectorEnv | CityParallelEnv) -> None:
    """Add what the car's program must know to a policy that another program exported.

    Its input has to be named `observation`, its output `action`.

    Args:
        path: Of the file; it is written anew.
        env: That it was trained in.

    Raises:
        LearningError: see `write_policy`.
    """
    _save(onnx.load(path), path, env)


def _save(model: onnx.ModelProto, path: Path, env: CityVectorEnv | CityParallelEnv) -> None:
    worlds = env.worlds
    if worlds.task.choices or worlds.junctions is not None:
        raise LearningError(f"{env.name}: expected throttle and steering, its actions are choices")
    seen = Observations(worlds, worlds.task.observations)
    speed, turn = worlds.reach.tolist()
    metadata = PolicyMetadata(
        policy=1, task=env.name, observations=seen.names, car=worlds.task.car,
        low=tuple(seen.low.tolist()), high=tuple(seen.high.tolist()),
        period_s=worlds.task.period_s, agents=worlds.agents, scm=scm.__version__,
        actions=worlds.action_names, action_low=(-speed, -turn), action_high=(speed, turn),
    )  # fmt: skip
    helper.set_model_props(model, {POLICY_KEY: msgspec.json.encode(metadata).decode()})
    onnx.save(model, path)
