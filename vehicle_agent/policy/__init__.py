"""Driving by a policy that was trained in `scm.gym`.

    model       the policy as an ONNX file, with its metadata
    senses      its observation, from what the car knows of itself, its map and its radio
    received    the part of it that sensors and radio receive, and goals
    ahead       the part of it that says how far the cars ahead and behind are
    driving     the policy behind the guard, as an agent

Driving needs onnxruntime of the extra scm[learn].
"""
