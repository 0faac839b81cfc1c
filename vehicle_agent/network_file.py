"""Trained networks as ONNX files."""

from pathlib import Path

import onnxruntime

from scm.errors import LearningError


def session_of(path: Path) -> onnxruntime.InferenceSession:
    """Return a file's network.

    Raises:
        LearningError: There is no such file, or it is no ONNX.
    """
    if not path.is_file():
        raise LearningError(f"{path}: expected a trained network (.onnx), got no such file")
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    options.log_severity_level = 4
    try:
        return onnxruntime.InferenceSession(
            path.read_bytes(), options, providers=["CPUExecutionProvider"]
        )
    except Exception as cause:  # of classes that the library does not name
        detail = str(cause).strip().splitlines()[-1]
        raise LearningError(f"{path}: expected a trained network (.onnx): {detail}") from cause
