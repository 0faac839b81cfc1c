"""Twins: since when a car has changed, what it is, and the versions of its car file."""

from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from scm.records.body import Body, By, Reason
from scm.records.fields import CarName, ReasonText, RequestedBy, TNs, VehicleName

EffectName = Annotated[str, Meta(description="Name of an effect.", examples=["steer_trim"])]
EffectNames = Annotated[
    tuple[str, ...], Meta(description="Names of effects.", examples=[["steer_trim", "gyro_bias"]])
]
ReportName = Annotated[
    str,
    Meta(description="Name of the mismatch report; empty: none.", examples=["twin-n3-1200"]),
]
PlaceM = Annotated[float, Meta(examples=[1.2])] | None
Kind = Literal["car", "tag", "place", "camera", "everywhere"]
Search = Literal[
    "driving", "searching", "named", "undecided", "unexplained", "elsewhere", "failed"
]  # fmt: skip
State = Literal["learning", "watching", "blind"]
WatchedS = Annotated[
    float, Meta(description="How long it was driven and watched [s].", examples=[812.0])
]
VersionNumber = Annotated[
    int, Meta(description="Number of a version; 0: the file that it came with.", examples=[1])
]


class TwinParameter(msgspec.Struct, kw_only=True, frozen=True):
    """A parameter of an effect with its 90 % interval, in its unit.

    Attributes:
        name: As reports call it.
        value: Since the change.
        low: Lower end of the 90 % interval.
        high: Upper end of the 90 % interval.
        unit: Of all of these.
        before: Before the change; null: the effect was not there.
    """

    name: Annotated[str, Meta(examples=["offset_rad"])]
    value: Annotated[float, Meta(examples=[-0.031])]
    low: Annotated[float, Meta(examples=[-0.033])]
    high: Annotated[float, Meta(examples=[-0.029])]
    unit: Annotated[str, Meta(examples=["rad"])] = ""
    before: Annotated[float, Meta(examples=[0.0])] | None = None


class TwinEffect(msgspec.Struct, kw_only=True, frozen=True):
    """An effect that explains a change.

    Attributes:
        probability: Among all that were tried.
        parameters: As it is since the change.
        text: What a mechanic would say.
    """

    name: EffectName
    probability: Annotated[float, Meta(examples=[0.97])]
    parameters: tuple[TwinParameter, ...]
    text: Annotated[str, Meta(examples=["The front wheels point 1.8° to the right."])] = ""


class TwinCause(msgspec.Struct, kw_only=True, frozen=True):
    """What a change may be of.

    Attributes:
        kind: `car`; `tag`: of this car; `place`: the floor there, for all cars; `camera`: for all
            cars that it sees; `everywhere`: for all cars since then, as a mopped floor.
        probability: Among all of these.
        x_m: Middle of the place, in the map frame; null: no place.
        y_m: Likewise.
        radius_m: Of the place; null: no place.
        camera: Empty: no camera, or its name is not known.
    """

    kind: Kind
    probability: Annotated[float, Meta(examples=[0.97])]
    x_m: PlaceM = None
    y_m: PlaceM = None
    radius_m: Annotated[float, Meta(examples=[0.35])] | None = None
    camera: Annotated[str, Meta(examples=["north"])] = ""


class TwinDrive(msgspec.Struct, kw_only=True, frozen=True):
    """The drive that would decide whose a change is, and how far it is.

    Attributes:
        vehicle: Which car would have to drive; empty: another one than all that are watched.
        x_m: Through where, in the map frame; null: it does not matter.
        y_m: Likewise.
        camera: That sees cars there, if it is what is to be decided about; empty: none.
        state: `open`: nobody has agreed yet; `waiting`: it is sent as soon as it has no other goal;
            `under_way`; `driven`; `failed`: why, says `reason`.
        reason: Why it waits or failed; empty: it does not.
        t_ns: Since when it is in that state, on the clock of the reports of the car that changed
            [ns].
        by: Who agreed.
        sent: How often a car was sent to decide this change.
    """

    vehicle: Annotated[str, Meta(description="A car's name.", examples=["n5"])]
    t_ns: TNs
    x_m: PlaceM = None
    y_m: PlaceM = None
    camera: Annotated[str, Meta(examples=["north"])] = ""
    state: Literal["open", "waiting", "under_way", "driven", "failed"] = "open"
    reason: ReasonText = ""
    by: RequestedBy = ""
    sent: Annotated[int, Meta(examples=[1])] = 0


class TwinChange(msgspec.Struct, kw_only=True, frozen=True):
    """A change of a car.

    Attributes:
        noticed_ns: When it was noticed, on the clock of the car's reports [ns].
        since_ns: When it most likely began [ns].
        since_low_ns: Not before that, with `since_high_ns` as a 90 % interval [ns].
        since_high_ns: Upper end of that interval [ns].
        effect: Known effect whose change looks most like it.
        parameter: Of that effect: what would have changed.
        size: By how much, in `unit`.
        unit: Of `size`.
        score: In standard deviations of what is usual.
        alike: Further effects that look nearly as much like it, the best first.
        search: How far the search for its cause is. `driving`: more driving is needed; `searching`;
            `named`; `undecided`: `between` these; `unexplained`: by no known effect;
            `elsewhere`: not searched for, since not the car changed, as `cause` says; `failed`:
            why, says `text`.
        effects: That explain it, the likeliest first.
        between: Effects that this driving cannot distinguish.
        drive_this: The drive that would.
        text: The result in one or two sentences.
        cause: Whose change it is, of `causes`, or `undecided`.
        causes: The likeliest first.
        decide_by: Which car would have to drive where to decide the cause; empty: it is decided.
        drive: That drive, and whether it is under way; null: none is known, or none was needed.
    """

    noticed_ns: TNs
    since_ns: TNs
    since_low_ns: TNs
    since_high_ns: TNs
    effect: EffectName
    parameter: Annotated[str, Meta(examples=["offset_rad"])]
    size: Annotated[float, Meta(examples=[-0.025])]
    unit: Annotated[str, Meta(examples=["rad"])]
    score: Annotated[float, Meta(examples=[30.0])]
    alike: EffectNames = ()
    search: Search = "driving"
    effects: tuple[TwinEffect, ...] = ()
    between: EffectNames = ()
    drive_this: Annotated[str, Meta(examples=["Drive a circle to the left at full steering."])] = ""
    text: Annotated[str, Meta(examples=["The front wheels point 1.8° to the right."])] = ""
    report: ReportName = ""
    cause: Kind | Literal["undecided"] = "undecided"
    causes: tuple[TwinCause, ...] = ()
    decide_by: Annotated[str, Meta(examples=["Let n5 drive through (1.2, 0.4)."])] = ""
    drive: TwinDrive | None = None


class TwinError(msgspec.Struct, kw_only=True, frozen=True):
    """An error of predictions, a root mean square in the unit in which its name ends.

    Attributes:
        name: Of what.
        before: Of the version that another was found from.
        now: Of that other.
    """

    name: Annotated[str, Meta(examples=["position_m"])]
    before: Annotated[float, Meta(examples=[0.041])]
    now: Annotated[float, Meta(examples=[0.018])]


class TwinVersion(msgspec.Struct, kw_only=True, frozen=True):
    """A version of a car's file.

    Attributes:
        file: Name or path of the car file.
        made_ns: When it was found [ns].
        state: `candidate`: compared on new driving; `adopted`; `rejected`: not better there;
            `rolled_back`: adopted first; `replaced`: a newer one is.
        after: Number of the version that it was found from.
        effects: That distinguish it, by name.
        by: Who adopted it, rejected it or rolled it back last.
        reason: Why.
        windows: Of 3 s, on driving that no fit has seen.
        errors: There, after 3 s.
        abilities: What the car can do by it, and could before: `cruise_mps`, at 0.8 of its
            throttle; `stopping_m`, from there; `turning_radius_m`, at full steering.
    """

    number: VersionNumber
    car: CarName
    file: Annotated[str, Meta(examples=["runs/twins/n3/1.toml"])]
    made_ns: TNs
    state: Literal["candidate", "adopted", "rejected", "rolled_back", "replaced"]
    after: VersionNumber = 0
    effects: EffectNames = ()
    by: RequestedBy = ""
    reason: ReasonText = ""
    report: ReportName = ""
    windows: Annotated[int, Meta(examples=[38])] = 0
    errors: tuple[TwinError, ...] = ()
    abilities: tuple[TwinParameter, ...] = ()


class Twin(msgspec.Struct, kw_only=True, frozen=True):
    """All that the city knows of one car's changes.

    Attributes:
        t_ns: Until when its reports were looked at, on their clock [ns].
        state: `learning` how the car usually strays; `watching`; `blind`: why, says `reason`.
        reason: Why it cannot be watched; empty: it can.
        changes: The newest last; at most 20.
        version: Number of the version in force.
        versions: All, by number; at most the newest 20.
    """

    vehicle: VehicleName
    t_ns: TNs
    car: CarName
    state: State
    driven_s: WatchedS
    reason: ReasonText = ""
    changes: tuple[TwinChange, ...] = ()
    version: VersionNumber = 0
    versions: tuple[TwinVersion, ...] = ()


class TwinRow(msgspec.Struct, kw_only=True, frozen=True):
    """One car in short.

    Attributes:
        t_ns: Until when its reports were looked at, on their clock [ns].
        state: `learning` how the car usually strays; `watching`; `blind`: why, says `reason`.
        reason: Why it cannot be watched; empty: it can.
        version: Number of the version in force.
        changes: How many were noticed; at most 20 are stored.
        changed_ns: When the newest began, on the clock of `t_ns` [ns]; null: it has not changed.
        search: How far the search for its cause is, as in the car's changes; null: likewise.
        newest: What it is, in short; empty: likewise.
        x_m: Middle of the place whose floor changed, in the map frame; null: it is no place.
        y_m: Likewise.
        radius_m: Of that place; null: likewise.
    """

    vehicle: VehicleName
    car: CarName
    t_ns: TNs
    state: State
    reason: ReasonText
    driven_s: WatchedS
    version: VersionNumber
    changes: int
    changed_ns: TNs | None
    search: Search | None
    newest: Annotated[str, Meta(examples=["steer trim, 97 %"])]
    x_m: PlaceM = None
    y_m: PlaceM = None
    radius_m: Annotated[float, Meta(examples=[0.35])] | None = None


class VersionBody(Body, kw_only=True, frozen=True):
    """By which version of its file a car is predicted from now on."""

    version: Annotated[
        int,
        Meta(ge=0, le=9999, description="its number; 0: the file that it came with", examples=[0]),
    ]
    by: By = ""
    reason: Reason = ""


class SendBody(Body, kw_only=True, frozen=True):
    """Which car is sent to where it decides whose a change is."""

    send: Annotated[
        str,
        Meta(
            pattern=r"^[a-z0-9_-]{1,32}$",
            description="the car to send, as the change's `drive` says",
            examples=["n5"],
        ),
    ]
    by: By = ""
    reason: Reason = ""
