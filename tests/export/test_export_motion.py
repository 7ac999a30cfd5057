"""What is written of a mechanism's motion: figure, table, and a glTF file that moves."""

from __future__ import annotations

import csv
import json
from functools import cache
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from films import File

import devcad
from devcad.errors import JobError
from devcad.export import Options, glb, motion
from devcad.part import Part
from devcad.simulate import motion as simulated

MOVING = Options(glb_animate=True)
MECHANISM = """name = "four"
tolerance = 0.02
[surface]
kind = "cylindrical-mechanism"
radius = 10
joints = [{joints}]
hinge = "{hinge}"
widths = 5
[place]
origin = [3, -4, 5]
z_axis = [1, 2, 2]
"""


@cache
def built(joints: str = "33.9, 155.9, 172.5, 57.5", hinge: str = "hole") -> Part:
    import tempfile

    with tempfile.TemporaryDirectory() as folder:
        job = Path(folder) / "four.toml"
        job.write_text(MECHANISM.format(joints=joints, hinge=hinge))
        return devcad.build(job)


def table(path: Path) -> dict[str, np.ndarray]:
    with path.open(newline="") as stream:
        names, *rows = csv.reader(stream)
    return dict(zip(names, np.array(rows, dtype=float).T, strict=True))


def test_the_table_keeps_every_length(tmp_path: Path) -> None:
    part = built()
    picture, written = motion.write(part, tmp_path, Options())
    assert (picture.path.name, written.path.name) == ("four-motion.svg", "four-motion.csv")
    rows = table(written.path)
    joints = np.stack([rows[f"joint{k}_x"] + 1j * rows[f"joint{k}_y"] for k in range(4)], axis=1)
    sides = np.abs(np.roll(joints, -1, axis=1) - joints)
    np.testing.assert_allclose(sides, part.linkages[0].lengths + 0.0 * sides, atol=1e-8)
    zero = rows["turn_deg"] == 0.0
    assert zero.sum() == 1
    np.testing.assert_allclose(np.abs(joints[zero]), 10.0, atol=1e-8)
    assert abs(rows["radial_least"][zero]) + abs(rows["radial_largest"][zero]) < 1e-8
    assert len(zero) > 60 and np.all(np.diff(rows["turn_deg"]) > 0.0)
    for name in ("input_deg", "output_deg", "coupler_deg"):
        assert np.abs(np.diff(rows[name])).max() < 90.0  # no jumps of a turn
    # the input from the ground line, joint 3 to joint 0
    seen = np.angle((joints[:, 1] - joints[:, 0]) / (joints[:, 3] - joints[:, 0]), deg=True)
    assert np.abs((rows["input_deg"] - seen + 180.0) % 360.0 - 180.0).max() < 1e-6


def test_the_figure_is_svg_in_mm_and_always_the_same(tmp_path: Path) -> None:
    text = motion.write(built(), tmp_path, Options())[0].path.read_bytes()
    assert text == motion.write(built(), tmp_path, Options())[0].path.read_bytes()
    root = ElementTree.fromstring(text)
    width, height = (float(root.attrib[key].removesuffix("mm")) for key in ("width", "height"))
    assert root.attrib["viewBox"] == f"0 0 {width:g} {height:g}"
    words = " ".join(element.text or "" for element in root.iter() if element.tag.endswith("text"))
    assert "mobility: both" in words and "transmission angle" in words
    assert "nan" not in text.decode("ascii")


def test_a_part_that_does_not_move_is_refused(tmp_path: Path) -> None:
    from jobs import built as plain

    with pytest.raises(JobError, match="this part is none"):
        motion.write(plain("arc"), tmp_path, Options())
    five = built("0, 60, 150, 200, 300")
    with pytest.raises(JobError, match="2 degrees of freedom"):
        motion.write(five, tmp_path, Options())
    assert glb.write(five, tmp_path, MOVING)[0].checks  # it stands still


def test_the_report_tells_the_motion(tmp_path: Path) -> None:
    report = devcad.export(built(), tmp_path, formats=["motion"])
    (told,) = json.loads((tmp_path / "four" / "report.json").read_text())["motion"]
    assert report["motion"] == [told]
    assert (told["mobility"], told["panels"]) == ("both", ["1", "2", "3", "4"])
    assert len(told["toggles"]) in (0, 2, 4)
    assert {file["path"] for file in report["files"]} == {"four-motion.svg", "four-motion.csv"}


class Links(File):
    """A GLB file whose nodes are rigid."""

    def posed(self, node: int, time: float) -> np.ndarray:
        """Points in mm, x, y, z as in the job, of a node's mesh at a time."""
        (primitive,) = self.tree["meshes"][self.tree["nodes"][node]["mesh"]]["primitives"]
        points = self.numbers(primitive["attributes"]["POSITION"])
        (animation,) = self.tree["animations"]
        found = {"translation": np.zeros(3), "rotation": np.array([0.0, 0.0, 0.0, 1.0])}
        for channel in animation["channels"]:
            if channel["target"]["node"] == node:
                sampler = animation["samplers"][channel["sampler"]]
                assert sampler["interpolation"] == "LINEAR"
                times = self.numbers(sampler["input"])[:, 0]
                values = self.numbers(sampler["output"])
                k = int(np.clip(np.searchsorted(times, time) - 1, 0, len(times) - 2))
                share = (time - times[k]) / (times[k + 1] - times[k])
                # close turns: the normalised mean is the spherical one to the cube of the step
                found[channel["target"]["path"]] = values[k] + share * (values[k + 1] - values[k])
        vector, w = found["rotation"][:3], found["rotation"][3]
        norm = vector @ vector + w * w
        turned = (w * w - vector @ vector) * points + 2.0 * w * np.cross(vector, points)
        turned += 2.0 * (points @ vector)[:, None] * vector
        x, y, z = (turned / norm + found["translation"]).T * 1e3
        return np.stack([x, -z, y], axis=1)


def test_links_turn_about_their_axes_where_the_mechanism_stands(tmp_path: Path) -> None:
    """The joint axis, in space, of two links is the same line at every time."""
    part = built()
    (written,) = glb.write(part, tmp_path, MOVING)
    file = Links(written.path)
    axis = np.array([1.0, 2.0, 2.0]) / 3.0
    (linkage,) = part.linkages
    place = np.array(linkage.place)
    np.testing.assert_allclose(place[:, 2], axis, atol=1e-15)
    found = simulated.motion(linkage)
    assert found.drive is not None
    low, high = found.stretch()
    for time in (0.0, 1.0, 2.7, 4.4, 8.0):
        moved = []
        for k in range(4):
            rest = part.panels[k].mesh.vertices
            seen = file.posed(k, time)
            assert np.abs((seen - rest) @ axis).max() < 1e-4  # nothing moves along the axis
            # the rigid motion that three.js shows, fitted
            middle, here = rest.mean(axis=0), seen.mean(axis=0)
            u, _, v = np.linalg.svd((rest - middle).T @ (seen - here))
            turn = (u @ np.diag([1.0, 1.0, np.linalg.det(u @ v)]) @ v).T
            assert np.abs((rest - middle) @ turn.T + here - seen).max() < 1e-3
            moved.append(lambda p, t=turn, a=middle, b=here: (p - a) @ t.T + b)
        for k, angle in enumerate(linkage.joints):
            point = place[:, :3] @ [10.0 * np.cos(angle), 10.0 * np.sin(angle), 0.0] + place[:, 3]
            assert np.linalg.norm(moved[k](point) - moved[k - 1](point)) < part.tolerance
        if time in (0.0, 8.0):
            assert (
                max(
                    np.abs(file.posed(k, time) - part.panels[k].mesh.vertices).max()
                    for k in range(4)
                )
                < 1e-4
            )
    assert high > low
    assert file.tree["animations"][0]["name"] == "motion"
    assert {c["target"]["node"] for c in file.tree["animations"][0]["channels"]} == {0, 1, 2}


def test_links_turn_back_at_a_toggle_without_leaving_their_joints(tmp_path: Path) -> None:
    """There coupler and output change their speed at once: with a key there few keys suffice."""
    part = built()
    file = File(glb.write(part, tmp_path, MOVING)[0].path)
    (linkage,) = part.linkages
    place = np.array(linkage.place)
    (animation,) = file.tree["animations"]
    times = file.numbers(animation["samplers"][0]["input"])[:, 0]
    assert len(times) < 1200
    found = simulated.motion(linkage)
    assert [way.end for way in found.directions] == ["toggle", "toggle"]
    joint = linkage.radius * np.exp(1j * linkage.joints[2])
    x, y, z = place[:, :3] @ [joint.real, joint.imag, 0.0] + place[:, 3]
    worst = 0.0
    for time in np.linspace(0.0, 8.0, 2000).tolist():
        # coupler and output at the joint between them; metres, y up
        ends = [file.node(k, time) @ [1e-3 * x, 1e-3 * z, -1e-3 * y, 1.0] for k in (1, 2)]
        worst = max(worst, 1e3 * float(np.linalg.norm(ends[1] - ends[0])))
    assert worst < 0.25 * part.tolerance


def test_the_figure_shows_links_of_a_much_larger_cylinder(tmp_path: Path) -> None:
    job = tmp_path / "flat.toml"
    job.write_text(
        'name = "flat"\n[surface]\nkind = "cylindrical-mechanism"\n'
        'links = [10, 20, 30, 20.0001]\nconformal = "crossed"\n'
    )
    path = motion.write(devcad.build(job), tmp_path, Options())[0].path
    circles = [e for e in ElementTree.parse(path).iter() if e.tag.endswith("circle")]
    cylinder, *joints = circles
    assert "clip-path" in cylinder.attrib
    places = np.array([[float(j.attrib["cx"]), float(j.attrib["cy"])] for j in joints])
    assert np.ptp(places, axis=0).max() > 50.0  # mm of paper
    assert places.min() > 0.0 and places[:, 0].max() < 130.0


def test_without_animation_the_file_is_the_static_one(tmp_path: Path) -> None:
    (tmp_path / "still").mkdir()
    still = Links(glb.write(built(), tmp_path / "still", Options(glb_animate=False))[0].path)
    moving = Links(glb.write(built(), tmp_path, MOVING)[0].path)
    assert moving.data.startswith(still.data)
    assert "animations" not in still.tree and moving.tree["nodes"] == still.tree["nodes"]


def test_one_sheet_with_living_hinges_stands_still(tmp_path: Path) -> None:
    """Its links are no bodies of their own; the figure and the table are made all the same."""
    part = built("0, 50, 170, 290", "living")
    assert len(part.panels) == 1
    file = Links(glb.write(part, tmp_path, MOVING)[0].path)
    assert "animations" not in file.tree
    assert len(motion.write(part, tmp_path, Options())) == 2
