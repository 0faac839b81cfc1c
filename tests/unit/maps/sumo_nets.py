"""Networks for the tests of the import, made by SUMO's own tools from what is written here."""

import subprocess
import sys
from pathlib import Path

import pytest

OSM = """<?xml version="1.0" encoding="UTF-8"?>
<osm version="0.6" generator="own">
  <node id="1" lat="48.00000" lon="11.00000"/>
  <node id="2" lat="48.00000" lon="11.00120"><tag k="highway" v="traffic_signals"/></node>
  <node id="3" lat="48.00010" lon="11.00240"/>
  <node id="4" lat="48.00080" lon="11.00110"/>
  <node id="5" lat="47.99920" lon="11.00130"/>
  <node id="6" lat="48.00080" lon="11.00000"/>
  <node id="7" lat="48.00045" lon="11.00250"/>
  <node id="8" lat="48.00080" lon="11.00230"/>
  <way id="10"><nd ref="1"/><nd ref="2"/><nd ref="3"/>
    <tag k="highway" v="secondary"/><tag k="maxspeed" v="50"/></way>
  <way id="11"><nd ref="4"/><nd ref="2"/><nd ref="5"/>
    <tag k="highway" v="residential"/><tag k="maxspeed" v="30"/></way>
  <way id="12"><nd ref="3"/><nd ref="7"/><nd ref="8"/><nd ref="4"/>
    <tag k="highway" v="residential"/><tag k="maxspeed" v="30"/></way>
  <way id="13"><nd ref="4"/><nd ref="6"/><nd ref="1"/>
    <tag k="highway" v="residential"/><tag k="maxspeed" v="30"/></way>
</osm>
"""

_LANE = """<lane id="{0}" type="driving" level="false">
  <link><predecessor id="{0}"/><successor id="{0}"/></link>
  <width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane>"""
_ROAD = """<road name="{name}" length="{length}" id="{id}" junction="-1">
  <link><predecessor elementType="road" elementId="{before}" contactPoint="end"/>
    <successor elementType="road" elementId="{after}" contactPoint="start"/></link>
  <planView><geometry s="0" x="{x}" y="{y}" hdg="{yaw}" length="{length}">{shape}</geometry>
  </planView>
  <lanes><laneSection s="0"><left>{left}</left>
    <center><lane id="0" type="none" level="false"/></center>
    <right>{right}</right></laneSection></lanes></road>"""


def stadium() -> str:
    """Return an OpenDRIVE ring: two straights of 40 m and two half circles of 20 m radius."""
    rows = [
        ("south", 40.0, 1, 0.0, 0.0, 0.0, "<line/>"),
        ("east", 62.83185307, 2, 40.0, 0.0, 0.0, '<arc curvature="0.05"/>'),
        ("north", 40.0, 3, 40.0, 40.0, 3.14159265, "<line/>"),
        ("west", 62.83185307, 4, 0.0, 40.0, 3.14159265, '<arc curvature="0.05"/>'),
    ]
    roads = "".join(
        _ROAD.format(
            name=name, length=length, id=number, x=x, y=y, yaw=yaw, shape=shape,
            before=(number - 2) % 4 + 1, after=number % 4 + 1,
            left=_LANE.format(1), right=_LANE.format(-1),
        )
        for name, length, number, x, y, yaw, shape in rows
    )  # fmt: skip
    head = '<header revMajor="1" revMinor="4" name="ring" version="1.00"/>'
    return f'<?xml version="1.0"?>\n<OpenDRIVE>{head}{roads}</OpenDRIVE>\n'


def made(tool: str, *arguments: str, out: Path) -> Path:
    """Return the network that a tool of SUMO makes; skip where there is none."""
    program = Path(sys.executable).parent / tool
    if not program.is_file():
        pytest.skip(f"{tool} is not installed: pip install eclipse-sumo")
    call = [str(program), *arguments, "--output-file", str(out)]
    done = subprocess.run(call, capture_output=True, text=True, check=False, timeout=200)
    assert done.returncode == 0, done.stderr
    return out


def grid(out: Path, kind: str, *more: str) -> Path:
    """Return a grid of 3 x 3 junctions of a kind, 56 m apart."""
    return made(
        "netgenerate", "--grid", "--grid.number", "3", "--grid.length", "56",
        "--default-junction-type", kind, *more, out=out,
    )  # fmt: skip


_NET = """<net version="1.20"{lefthand}>
<location netOffset="0,0" convBoundary="0.00,0.00,120.00,120.00" origBoundary="0,0,1,1"
 projParameter="!"/>
<edge id="{w}" from="W" to="C"><lane id="{w}_0" index="0" speed="13.9" length="56" {west}/></edge>
<edge id="{s}" from="S" to="C">
 <lane id="{s}_0" index="0" speed="13.9" length="53" shape="64.8,0 64.8,52.8"/>
 <lane id="{s}_1" index="1" speed="13.9" length="53" shape="61.6,0 61.6,52.8"/></edge>
<edge id="{e}" from="C" to="E">
 <lane id="{e}_0" index="0" speed="13.9" length="50" shape="70.4,58.4 120,58.4"/></edge>
<edge id="{n}" from="C" to="N">
 <lane id="{n}_0" index="0" speed="13.9" length="56" shape="61.6,64 61.6,120"/></edge>
{programs}
<junction id="C" type="priority" x="60" y="60" incLanes="{s}_0 {s}_1 {w}_0" intLanes="" shape=""/>
<junction id="E" type="dead_end" x="120" y="60" incLanes="{e}_0" intLanes="" shape=""/>
<junction id="N" type="dead_end" x="60" y="120" incLanes="{n}_0" intLanes="" shape=""/>
<junction id="S" type="dead_end" x="60" y="0" incLanes="" intLanes="" shape=""/>
<junction id="W" type="dead_end" x="0" y="60" incLanes="" intLanes="" shape=""/>
<connection from="{s}" to="{n}" fromLane="1" toLane="0" dir="s" state="M"{s_n}/>
<connection from="{w}" to="{e}" fromLane="0" toLane="0" dir="s" state="m"{w_e}/>
<connection from="{s}" to="{e}" fromLane="0" toLane="0" dir="r" state="m"{s_e}/>
</net>
"""


def tee(
    phases=(), *, lit=("s_n", "w_e"), lights=None, edges="W2C S2C C2E C2N", lefthand=False,
    west="0,58.4 56,58.4",
):  # fmt: skip
    """Return a network in words: west and south lead to east, south to north as well.

    Args:
        phases: Of its signal program: (seconds, letters), or with the following phases as a third.
        lit: The ways with a signal, in the order of the letters.
        lights: The traffic light of each of them; without, all are of `C`.
        edges: Ids of the edges from west and south, to east and north.
        lefthand: Whether cars drive on the left.
        west: The lane from the west.
    """
    lights = lights or ["C"] * len(lit)
    signals = dict.fromkeys(("s_n", "w_e", "s_e"), "")
    if phases:
        for number, (way, light) in enumerate(zip(lit, lights, strict=True)):
            signals[way] = f' tl="{light}" linkIndex="{number}"'
    rows = "".join(
        f'<phase duration="{phase[0]}" state="{phase[1]}"'
        + (f' next="{phase[2]}"/>' if len(phase) > 2 else "/>")
        for phase in phases
    )
    programs = "".join(
        f'<tlLogic id="{light}" type="static" programID="0" offset="0">{rows}</tlLogic>'
        for light in dict.fromkeys(lights if phases else ())
    )
    names = dict(zip("wsen", edges.split(), strict=True))
    return _NET.format(
        lefthand=' lefthand="true"' if lefthand else "", programs=programs,
        west=f'shape="{west}"', **names, **signals,
    )  # fmt: skip
