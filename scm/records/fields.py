"""Fields that records share: a name and a type have one meaning, with unit and an example.

A record whose field means something more special says so below `Attributes:` of its docstring,
which goes before what is written here. The examples are of one moment in the driving school.
"""

from typing import Annotated

from msgspec import Meta

AgeS = Annotated[float, Meta(description="Time since it was last received [s].", examples=[0.2])]
AtM = Annotated[
    float, Meta(description="Where along the lane, from its start [m].", examples=[1.2])
]
CameraName = Annotated[str, Meta(description="Name of a camera.", examples=["ceiling"])]
CameraNames = Annotated[tuple[str, ...], Meta(description="Cameras.", examples=[["front_camera"]])]
CarName = Annotated[str, Meta(description="Name of its car file.", examples=["nigel"])]
CarNames = Annotated[
    tuple[str, ...], Meta(description="Cars, or names of them.", examples=[["n1", "n2"]])
]
CityName = Annotated[
    str,
    Meta(
        pattern=r"^[a-z0-9_-]{1,32}$", description="Name of a city on the bus.", examples=["lab_b"]
    ),
]
ColourName = Annotated[str, Meta(description="Colour.", examples=["green"])]
CycleS = Annotated[float, Meta(description="How long its cycle is [s].", examples=[40.0])]
Detail = Annotated[
    str, Meta(description="Its own report, or what was seen, as text.", examples=["4 cars"])
]
Digest = Annotated[
    str, Meta(description="Hash of the newest entry, hexadecimal.", examples=["0" * 64])
]
EndNs = Annotated[int, Meta(description="When it ends [ns]; null: not known yet.")]
EndS = Annotated[float, Meta(description="When it ends [s].", examples=[14.0])]
ErrorText = Annotated[
    str,
    Meta(
        description="What failed, in words.", examples=["runs/today.mcap: it holds no car named n9"]
    ),
]
FaultName = Annotated[
    str, Meta(description="What the monitor latched; null: all is well.", examples=["conflict"])
]
GroupName = Annotated[
    str,
    Meta(
        description="Name of a signal group: heads that always show the same.",
        examples=["south_east"],
    ),
]
GroupNames = Annotated[
    tuple[str, ...], Meta(description="Signal groups.", examples=[["south_east"]])
]
HeightM = Annotated[float, Meta(description="Above the floor [m].", examples=[0.2])]
HeightPx = Annotated[int, Meta(description="Rows of the picture.", examples=[720])]
Id = Annotated[str, Meta(description="What it is called below its noun.", examples=["mismatch-7"])]
ImageFile = Annotated[str, Meta(description="File beside the map file.", examples=["friction.png"])]
IsAlive = Annotated[
    bool, Meta(description="Whether it is there; false: it left or died.", examples=[True])
]
JunctionName = Annotated[str, Meta(description="Name of a junction.", examples=["crossing"])]
KindName = Annotated[str, Meta(description="Of which sort it is.", examples=["hosted"])]
LaneName = Annotated[str, Meta(description="Name of a lane.", examples=["east_loop"])]
LatencyMs = Annotated[
    float, Meta(description="From exposure to being taken up [ms].", examples=[41.5])
]
LengthM = Annotated[float, Meta(description="How long it is [m].", examples=[1.8])]
ModeName = Annotated[str, Meta(description="What governs it now.", examples=["plan"])]
Name = Annotated[str, Meta(description="What it is called.", examples=["crossing"])]
Note = Annotated[str, Meta(description="The comment on it.", examples=["tyre put back on"])]
NotesText = Annotated[str, Meta(description="What people wrote about it.", examples=["n3 slipped"])]
Number = Annotated[int, Meta(description="Its number.", examples=[1])]
OwnerName = Annotated[str, Meta(description="Who holds it.", examples=["world"])]
Passed = Annotated[int, Meta(description="Cars that passed, in the window.", examples=[14])]
PendingName = Annotated[str, Meta(description="What is to come into force.", examples=["busy"])]
PlanName = Annotated[str, Meta(description="Name of the signal plan in force.", examples=["calm"])]
Points = Annotated[
    tuple[tuple[float, float], ...],
    Meta(
        description="Its corners, or the points along it: x, y [m].",
        examples=[[[0.5, 0.2], [0.9, 0.2]]],
    ),
]
PolicyName = Annotated[str, Meta(description="Name of the policy in force.", examples=["fixed"])]
Purpose = Annotated[
    str, Meta(description="What it is for, in a sentence.", examples=["more green for the north"])
]
ReasonText = Annotated[str, Meta(description="Why.", examples=["a hand on the floor"])]
RecordingNames = Annotated[
    tuple[str, ...],
    Meta(description="Names of recordings.", examples=[["city-20261123-031838.mcap"]]),
]
RequestedBy = Annotated[str, Meta(description="Who requested it.", examples=["ada"])]
RouteLanes = Annotated[
    tuple[str, ...],
    Meta(
        description="Lanes to pass, in this order.", examples=[["crossing_south_east", "east_loop"]]
    ),
]
SeverityName = Annotated[
    str, Meta(description="`info`, `warning` or `error`.", examples=["warning"])
]
SourceName = Annotated[str, Meta(description="Who reported it.", examples=["world"])]
SpeedMps = Annotated[float, Meta(description="Speed, + = forward [m/s].", examples=[0.21])]
StartNs = Annotated[int, Meta(description="When it began [ns].")]
StartS = Annotated[float, Meta(description="When it begins [s].", examples=[2.0])]
StationName = Annotated[str, Meta(description="Name of a station on the bus.", examples=["n1"])]
StatusText = Annotated[str, Meta(description="How it is.", examples=["ok"])]
TNs = Annotated[
    int,
    Meta(description="When it was true, on the clock of its source [ns].", examples=[120000000000]),
]
TS = Annotated[float, Meta(description="Since the begin of the recording [s].", examples=[12.5])]
TagId = Annotated[int, Meta(description="Number of an AprilTag.", examples=[1])]
Text = Annotated[
    str, Meta(description="One sentence for a person.", examples=["n1 touched a wall"])
]
Title = Annotated[str, Meta(description="What people call it.", examples=["Driving School"])]
TripId = Annotated[str, Meta(description="Of this trip.", examples=["n1-3"])]
VehicleName = Annotated[str, Meta(description="Name of a car.", examples=["n1"])]
VerdictText = Annotated[
    str,
    Meta(
        description="The verdict in a sentence.",
        examples=["The car grips less than its file says."],
    ),
]
VoidReasons = Annotated[
    tuple[str, ...],
    Meta(
        description="Why a measurement does not count; none: it does.",
        examples=[["the signals of crossing flash for 4.0 of 10.0 s"]],
    ),
]
WidthM = Annotated[float, Meta(description="How wide it is [m].", examples=[0.257])]
WidthPx = Annotated[int, Meta(description="Columns of the picture.", examples=[1280])]
WindowS = Annotated[float, Meta(description="Over how long it was counted [s].", examples=[300.0])]
XM = Annotated[float, Meta(description="To the right on the map [m].", examples=[1.384])]
XRangeM = Annotated[tuple[float, float], Meta(description="To the right on the map [m].")]
YM = Annotated[float, Meta(description="Up on the map [m].", examples=[0.655])]
YRangeM = Annotated[tuple[float, float], Meta(description="Up on the map [m].")]
YawRad = Annotated[
    float, Meta(description="Direction, counter-clockwise from map x [rad].", examples=[-0.785])
]
