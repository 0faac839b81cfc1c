"""Sensors against each other, before any physics is blamed: what the data itself gets wrong.

`prepare` is the entry point: it screens rows (`timestamps`, `row_spacing`, `spikes`,
`encoder_counts`), checks the recording, repairs it and cuts it at its gaps. `check` calls every
check: of one channel `clipped_channels`, `frozen_channels` and `commands`; of the car
`expected_motion`; of two signals `signal_pairs`, whose gross faults `repairs` undoes; of the pose
along its `pose_track` against other sensors `distance` and `pose_comparison`, through a
`whitened_fit`. `suspected_faults` names the fault that would explain a difference. Results are in
`quality`. May import recording, vehicles.
"""
