"""Sensors against each other, before any physics is blamed: what the data itself gets wrong.

`prepare` is the entry point. It screens rows (`timestamps`, `bursts`, `spikes`, `encoder_counts`,
within the car's `physical_limits`), runs every `check`, applies `repairs` of gross faults
(`unit_errors`, `clock_offsets`, `pair_repairs`, `command_units`, `clipped_channels`) and cuts the
recording into `stretches`. `row_spacing`, `frozen_channels`, `commands` and `other_car` look at the
file; `sensor_pairs` compares two sensors each (`heading`, `distance`, `accelerometer`) along the
`pose_track`, through a `whitened_fit`; `suspected_faults` names the fault that would explain a
difference. Results are in `problem` and `quality`. May import recording, vehicles.
"""
