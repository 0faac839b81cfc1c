"""Behavioural cloning: a network learns to steer from what somebody drove.

    recording        while somebody drives: frames of the front camera, and the commands in force
    demonstration    these as files
    augmentation     frames as from beside the way, in other light, mirrored
    network          what networks there are
    training         one of them, fitted to the demonstration
    model_file       it as an ONNX file, with its metadata
    learning         from the files of the one to that of the other
    driving          the network behind the guard, as an agent that sees only its front camera
    signal_rule      above it: how much throttle the signals allow

Training needs the extra scm[learn]; driving needs onnxruntime of it alone.
Source: Samak, Samak and Kandhasamy, "Robust behavioral cloning for autonomous vehicles using
end-to-end imitation learning", SAE International Journal of CAV, 2021: the smallest network,
balancing and augmentation; Bojarski et al., "End to end learning for self-driving cars", 2016:
PilotNet, and views of a car that stands beside its way.
"""
