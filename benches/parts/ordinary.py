"""Ordinary parts from a CAD kernel, each through `gripgen init`, `check`, `try` and the sweep that `init` wrote, unedited.

    pip install cadquery trimesh
    python benches/parts/ordinary.py --gripgen target/release/gripgen --work /tmp/ordinary

OpenCASCADE models and triangulates them, so neither shapes nor meshes are ours. A part for which `init` finds no grip is a refusal, listed with
its reason. `docs/parts.md` has the table of one run.
"""

import argparse
import csv
import json
import subprocess
import time
from math import cos, pi, sin, tau
from pathlib import Path

import cadquery as cq
import trimesh

PARTS = {}


def part(make):
    """Adds a part under the name of its function."""
    PARTS[make.__name__] = make
    return make


def bar(length, *steps):
    """A turned bar: (diameter, up to this z)."""
    body, low = None, 0.0
    for diameter, high in steps:
        disc = cq.Workplane("XY").workplane(offset=low).circle(diameter / 2).extrude(high - low)
        body, low = (disc if body is None else body.union(disc)), high
    assert low == length
    return body


def hexagon(across, height):
    """A hexagonal prism, by its width across flats."""
    return cq.Workplane("XY").polygon(6, across / cos(pi / 6)).extrude(height)


# The six of the user's trial.
@part
def l_bracket():
    body = cq.Workplane("XY").box(40, 20, 4, centered=(False, True, False))
    body = body.union(cq.Workplane("XY").box(4, 20, 40, centered=(False, True, False)))
    return body.faces(">X").edges("|Z").fillet(4).faces("<Z").workplane(centerOption="CenterOfBoundBox").center(8, 0).hole(5)


@part
def stepped_shaft():
    return bar(60, (8, 25), (24, 31), (8, 60)).edges().chamfer(0.4)


@part
def bolt():
    return hexagon(13, 5.3).union(bar(40, (8, 40)).translate((0, 0, 5.3))).edges(">Z").chamfer(0.8)


@part
def mug():
    body = cq.Workplane("XY").circle(20).extrude(45).faces(">Z").shell(-2.5)
    path = cq.Workplane("XZ").moveTo(18.5, 10).threePointArc((36, 23), (18.5, 36))
    ear = cq.Workplane("YZ", origin=(18.5, 0, 10)).circle(3).sweep(path)
    return body.union(ear).cut(cq.Workplane("XY").workplane(offset=2.5).circle(17.5).extrude(45))


@part
def m8_screw():
    shank = bar(35, (6.8, 35))
    for k in range(24):
        shank = shank.union(cq.Workplane("XZ").polyline([(3.3, 4 + 1.25 * k), (4, 4.55 + 1.25 * k), (4, 4.7 + 1.25 * k), (3.3, 5.25 + 1.25 * k)]).close().revolve(360, (0, 0, 0), (0, 1, 0)))
    return shank.union(bar(8, (13, 8)).faces(">Z").workplane().polygon(6, 6.9).cutBlind(-4).translate((0, 0, 35)))


@part
def sphere_with_holes():
    return cq.Workplane("XY").sphere(12)


# Thirty others.
@part
def nut_m12():
    return hexagon(18, 10.8).faces(">Z").workplane().hole(10.2)


@part
def washer():
    return cq.Workplane("XY").circle(12).circle(6.5).extrude(2.5)


@part
def pipe_elbow():
    path = cq.Workplane("XZ").moveTo(0, 0).lineTo(0, 15).radiusArc((15, 30), 15).lineTo(30, 30)
    return cq.Workplane("XY").circle(8).circle(6).sweep(path)


@part
def pipe_tee():
    run = cq.Workplane("XY").circle(9).extrude(50)
    arm = cq.Workplane("YZ", origin=(0, 0, 25)).circle(9).extrude(25)
    bore = cq.Workplane("XY").circle(7).extrude(50).union(cq.Workplane("YZ", origin=(0, 0, 25)).circle(7).extrude(25))
    return run.union(arm).cut(bore)


@part
def hinge_leaf():
    body = cq.Workplane("XY").box(30, 40, 2)
    for y in (-15, 5):
        body = body.union(cq.Workplane("XZ", origin=(16, y + 10, 0)).circle(3.5).extrude(10))
    return body.cut(cq.Workplane("XZ", origin=(16, 30, 0)).circle(1.6).extrude(60)).faces("<Z").workplane(centerOption="CenterOfBoundBox").pushPoints([(-8, 12), (-8, -12)]).hole(4)


@part
def v_pulley():
    return cq.Workplane("XZ").polyline([(4, 0), (18, 0), (18, 2), (13, 6), (18, 10), (18, 12), (4, 12)]).close().revolve(360, (0, 0, 0), (0, 1, 0))


@part
def pillow_block():
    body = cq.Workplane("XY").box(50, 14, 8).union(cq.Workplane("XZ", origin=(0, 7, 12)).circle(13).extrude(14))
    return body.cut(cq.Workplane("XZ", origin=(0, 7, 12)).circle(6).extrude(14)).faces(">Z[0]").workplane(centerOption="CenterOfBoundBox", offset=0).pushPoints([(20, 0), (-20, 0)]).circle(2.2).cutThruAll()


@part
def u_channel():
    return cq.Workplane("XY").rect(24, 18).extrude(60).cut(cq.Workplane("XY").center(0, 3).rect(18, 18).extrude(60)).edges("|Z").fillet(1)


@part
def clevis():
    body = cq.Workplane("XY").box(18, 16, 36)
    body = body.cut(cq.Workplane("XY").box(8, 20, 22).translate((0, 0, 9))).cut(cq.Workplane("YZ", origin=(-15, 0, 10)).circle(4).extrude(30))
    return body.edges("|X and >Z").fillet(6)


@part
def connecting_rod():
    body = cq.Workplane("XY").circle(11).extrude(8).union(cq.Workplane("XY").center(45, 0).circle(7).extrude(8))
    body = body.union(cq.Workplane("XY").box(45, 8, 4, centered=(False, True, False)).translate((0, 0, 2)))
    return body.cut(cq.Workplane("XY").circle(7).extrude(8)).cut(cq.Workplane("XY").center(45, 0).circle(4).extrude(8))


@part
def cam_lever():
    return cq.Workplane("XY").ellipse(14, 9).extrude(8).union(cq.Workplane("XY").box(50, 7, 5, centered=(False, True, False))).faces(">Z").workplane().center(-5, 0).hole(6)


@part
def bolted_flange():
    return cq.Workplane("XY").circle(20).extrude(6).union(bar(20, (16, 20))).faces("<Z").workplane().hole(9).faces("<Z").workplane().polarArray(15, 0, 360, 6).hole(3.4)


@part
def small_motor():
    return cq.Workplane("XY").box(35, 35, 26).edges("|Z").chamfer(3).faces(">Z").workplane().circle(11).extrude(2).faces(">Z").workplane().circle(2.5).extrude(20)


@part
def usb_plug():
    body = cq.Workplane("XY").box(16, 9, 22).edges("|Z").fillet(2)
    return body.faces(">Z").workplane().rect(12, 4.5).extrude(12).faces(">Z").workplane().rect(11, 1.8).cutBlind(-9)


@part
def ribbed_cap():
    body = cq.Workplane("XY").circle(14).extrude(14)
    for k in range(40):
        body = body.union(cq.Workplane("XY").center(14 * cos(tau * k / 40), 14 * sin(tau * k / 40)).circle(0.6).extrude(13))
    return body.cut(cq.Workplane("XY").circle(12).extrude(12))


@part
def funnel():
    return cq.Workplane("XZ").polyline([(3, 0), (4.5, 0), (4.5, 18), (20, 40), (18.5, 40), (3, 19)]).close().revolve(360, (0, 0, 0), (0, 1, 0))


@part
def banana():
    path = cq.Workplane("XZ").moveTo(-35, 0).threePointArc((0, 14), (35, 0))
    body = cq.Workplane("YZ", origin=(-35, 0, 0)).circle(9).sweep(path)
    return body.union(cq.Workplane("XY").sphere(9).translate((-35, 0, 0))).union(cq.Workplane("XY").sphere(9).translate((35, 0, 0)))


@part
def screwdriver():
    return bar(80, (14, 40), (10, 45), (5, 80)).cut(cq.Workplane("XY").workplane(offset=72).center(0, 5.5).rect(10, 8).extrude(8)).cut(cq.Workplane("XY").workplane(offset=72).center(0, -5.5).rect(10, 8).extrude(8))


@part
def hex_key():
    path = cq.Workplane("XZ").moveTo(0, 0).lineTo(0, 20).radiusArc((5, 25), 5).lineTo(60, 25)
    return cq.Workplane("XY").polygon(6, 5.8).sweep(path)


@part
def door_key():
    body = cq.Workplane("XY").circle(11).extrude(2).union(cq.Workplane("XY").box(32, 8, 2, centered=(False, True, False)).translate((8, 0, 0)))
    for k, depth in enumerate((1, 2.5, 1.5, 3, 2)):
        body = body.cut(cq.Workplane("XY").box(2.5, depth, 2, centered=(False, False, False)).translate((18 + 4 * k, 4 - depth, 0)))
    return body.cut(cq.Workplane("XY").center(-5, 0).circle(3).extrude(2))


@part
def brick_2x4():
    body = cq.Workplane("XY").box(31.8, 15.8, 9.6).faces("<Z").shell(-1.2)
    return body.union(cq.Workplane("XY").workplane(offset=4.79).rarray(8, 8, 4, 2).circle(2.4).extrude(1.8))


@part
def die():
    body = cq.Workplane("XY").box(16, 16, 16).edges().fillet(1.5)
    for x, y in ((-4, -4), (4, 4), (0, 0)):
        body = body.cut(cq.Workplane("XY").sphere(1.6).translate((x, y, 8.4)))
    return body


@part
def pen():
    return cq.Workplane("XZ").polyline([(0, 0), (1, 0), (4, 14), (4, 90), (0, 90)]).close().revolve(360, (0, 0, 0), (0, 1, 0))


@part
def coil_spring():
    return cq.Workplane("XZ", origin=(8, 0, 0)).circle(1.5).sweep(cq.Workplane(cq.Wire.makeHelix(6, 30, 8)), isFrenet=True)


@part
def wing_nut():
    body = bar(9, (13, 9))
    wing = cq.Workplane("XZ", origin=(0, 1.5, 0)).polyline([(4, 2), (15, 9), (17, 16), (12, 17), (4, 9)]).close().extrude(3)
    return body.union(wing).union(wing.mirror("YZ")).faces("<Z").workplane().hole(6)


@part
def ring():
    return cq.Workplane("XZ").center(16, 0).circle(4).revolve(360, (-16, 0, 0), (-16, 1, 0))


@part
def star_knob():
    body = cq.Workplane("XY").circle(15).extrude(12)
    for k in range(6):
        body = body.cut(cq.Workplane("XY").center(18 * cos(tau * k / 6), 18 * sin(tau * k / 6)).circle(6).extrude(12))
    return body.faces("<Z").workplane().circle(6).extrude(10).edges(">Z").fillet(1)


@part
def mains_plug():
    body = cq.Workplane("XY").rect(34, 13).extrude(24, taper=6)
    return body.faces("<Z").workplane().pushPoints([(9.5, 0), (-9.5, 0)]).circle(2).extrude(19)


@part
def heat_sink():
    body = cq.Workplane("XY").box(36, 30, 4)
    for x in range(-16, 17, 4):
        body = body.union(cq.Workplane("XY").box(1.2, 30, 18).translate((x, 0, 10)))
    return body


@part
def spacer_tube():
    return cq.Workplane("XY").circle(5).circle(3.2).extrude(30)


@part
def card_edge():
    return cq.Workplane("XY").box(50, 30, 1.6).union(cq.Workplane("XY").box(12, 10, 3).translate((5, 4, 2.2))).union(cq.Workplane("XY").box(6, 4, 1.2).translate((-14, -6, 1.3)))


@part
def cross_joint():
    return cq.Workplane("XY").circle(5).extrude(46).union(cq.Workplane("YZ", origin=(-23, 0, 23)).circle(5).extrude(46)).union(cq.Workplane("XY").sphere(9).translate((0, 0, 23)))


def mesh_of(name, work):
    """Triangulated by OpenCASCADE to 0.02 mm; the sphere loses some triangles."""
    path = work / f"{name}.stl"
    cq.exporters.export(PARTS[name](), str(path), tolerance=0.02, angularTolerance=0.1)
    if name == "sphere_with_holes":
        mesh = trimesh.load(path)
        keep = [k for k in range(len(mesh.faces)) if k % 97]
        mesh.update_faces([k in set(keep) for k in range(len(mesh.faces))])
        mesh.export(path)
    return path


def run(*command):
    """Exit code, seconds and what was said."""
    started = time.time()
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True)
    return done.returncode, time.time() - started, (done.stdout + done.stderr).strip()


def tried(gripgen, name, work, samples):
    """One row of the table."""
    path = mesh_of(name, work)
    row = {"part": name, "triangles": len(trimesh.load(path).faces)}
    code, row["init_s"], said = run(gripgen, "init", path, "-o", work / name, "--force")
    if code:
        return row | {"refused": said.splitlines()[0][:160]}
    run(gripgen, "check", work / name / "sweep.toml", "--json", work / f"{name}.json", "--force")
    row["warned"] = sum(len(grip["failed"]) for grip in json.loads((work / f"{name}.json").read_text())["grips"])
    _, row["try_s"], _ = run(gripgen, "try", path, "-o", work / f"{name}.html", "--force")
    extra = ["--set", f"samples={samples}", "--set", "mechanics=reduced", "--set", "images=none"]
    run(gripgen, "sweep", work / name / "sweep.toml", "-o", work / f"{name}-run", "-q", *extra)
    with (work / f"{name}-run" / "index.csv").open() as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    failed = [r for r in rows if r["status"] == "failed"]
    return row | {
        "samples": len(rows),
        "failed": len(failed),
        "no_contact": sum(r["status"] == "no_contact" for r in rows),
        "why": sorted({r["failure"][:70] for r in failed}),
    }


def main():
    """The table as lines and as JSON."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--gripgen", default="gripgen")
    parser.add_argument("--work", type=Path, required=True)
    parser.add_argument("--samples", type=int, default=200)
    parser.add_argument("names", nargs="*")
    options = parser.parse_args()
    options.work.mkdir(parents=True, exist_ok=True)
    rows = []
    for name in options.names or PARTS:
        rows.append(tried(options.gripgen, name, options.work, options.samples))
        print(json.dumps(rows[-1]), flush=True)
    (options.work / "table.json").write_text(json.dumps(rows, indent=1))
    held = [r for r in rows if "failed" in r]
    print(f"{len(rows)} parts, {len(rows) - len(held)} refused; of the others {sum(r['failed'] > 0.02 * r['samples'] for r in held)} fail in more than 2 %")


if __name__ == "__main__":
    main()
