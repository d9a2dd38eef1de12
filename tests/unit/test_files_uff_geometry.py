"""Geometry and modes of UFF files: vendors' exports, axes of nodes, shapes that read back."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from deboom import plot
from deboom.errors import InputError
from deboom.files.function_table import Dof
from deboom.files.rows import PlacedImpact, PlacedSensor, write_positions
from deboom.files.tables import read_table
from deboom.files.uff import UffFunction, write_sets
from deboom.files.uff_geometry import placed_at_nodes, read_uff_geometry
from deboom.files.uff_modes import (
    UffModes,
    modes_at_nodes,
    read_uff_modes,
    write_uff_modes,
)

VENDORS = Path(__file__).parents[1] / "data" / "pyuff-vendor-files"
TESTLAB = VENDORS / "TestLab_161_164_18_15_82.uff"
ARTEMIS = VENDORS / "Artemis_export_-_Geometry_RPBC_setup_05_14102016_105117.uff"
OROS = VENDORS / "mesh_Oros-modal_uff15_uff2412.uff"
MODE = VENDORS / "uff55_translation_rotation.uff"


def test_a_geometry_of_testlab_has_turned_nodes_and_trace_lines():
    geometry = read_uff_geometry(TESTLAB)
    assert geometry.nodes.tolist() == list(range(1, 37))
    # by hand: rows of data sets 15, 18 and 82
    np.testing.assert_allclose(geometry.positions[1], [-2.6, 2.05, 0.0])
    np.testing.assert_allclose(geometry.orientations[0], np.diag([-1.0, 1.0, -1.0]), atol=1e-6)
    assert geometry.traces[0] == (1, 4, 5, 2, 3, 0, 1, 2)
    assert geometry.traces[1] == (6, 7, 10, 13, 16, 17)
    assert len(geometry.traces) == 11
    for axes in geometry.orientations:
        np.testing.assert_allclose(axes.T @ axes, np.eye(3), atol=1e-6)
        assert np.linalg.det(axes) == pytest.approx(1.0)


def test_geometries_of_artemis_and_oros_need_their_unit_of_length():
    for path in (ARTEMIS, OROS):
        with pytest.raises(InputError, match="states no unit of length"):
            read_uff_geometry(path)
    artemis = read_uff_geometry(ARTEMIS, "m")
    assert (artemis.nodes.size, len(artemis.traces)) == (74, 108)
    np.testing.assert_allclose(artemis.positions[1], [1.53, 0.0, 0.0])
    oros = read_uff_geometry(OROS, length="mm")
    assert oros.nodes[0] == 7
    np.testing.assert_allclose(oros.positions[0], [-0.051619, 0.051619, 0.05])


def written(path, *, disp=0, kind=2411, systems=(), traces=((1, 2),)):
    columns = {"node_nums": [1, 2], "def_cs": [0, 0], "disp_cs": [disp, 0], "color": [1, 1]}
    places = {"x": [0.0, 1.0], "y": [2.0, 3.0], "z": [4.0, 5.0]}
    sets = [{"type": kind, **{k: np.array(v) for k, v in (columns | places).items()}}]
    sets += [
        {"type": 82, "trace_num": n, "n_nodes": len(line), "id": "line", "nodes": np.array(line)}
        for n, line in enumerate(traces, 1)
    ]
    write_sets(path, [*systems, *sets])
    return path


def system(number, kind=0):
    turn = [[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 0.0]]
    return {
        "type": 2420,
        "Part_UID": 1,
        "Part_Name": "body",
        "CS_sys_labels": [number],
        "CS_types": [kind],
        "CS_colors": [1],
        "CS_names": ["turned"],
        "CS_matrices": [np.array(turn)],
    }


@pytest.mark.parametrize("kind", [15, 2411])
def test_nodes_in_systems_of_their_own_are_turned(tmp_path, kind):
    path = written(tmp_path / "body.uff", disp=7, kind=kind, systems=[system(7)])
    geometry = read_uff_geometry(path)
    np.testing.assert_allclose(geometry.positions, [[0, 2, 4], [1, 3, 5]])
    # a quarter turn about z: the node's x is y of the file
    np.testing.assert_allclose(geometry.orientations[0][:, 0], [0.0, 1.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(geometry.orientations[1], np.eye(3))


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"disp": 7}, "coordinate system 7, which is not in the file"),
        ({"disp": 7, "systems": [system(7, kind=1)]}, "system 7 is cylindrical or spherical"),
        ({"traces": ((1, 3),)}, "a trace line goes to node 3, which is not there"),
    ],
)
def test_what_is_wrong_in_a_geometry_is_named(tmp_path, options, words):
    path = written(tmp_path / "body.uff", **options)
    with pytest.raises(InputError, match=words) as caught:
        read_uff_geometry(path)
    assert str(path) in str(caught.value)


@pytest.mark.parametrize("kind", [15, 2411])
def test_a_node_that_is_no_whole_number_is_refused(tmp_path, kind):
    path = written(tmp_path / "body.uff", kind=kind)
    text = path.read_text()
    assert "\n         2" in text
    path.write_text(text.replace("\n         2", "\n       2.5", 1))
    with pytest.raises(InputError, match=r"node 2\.5 is no whole number"):
        read_uff_geometry(path)


def test_a_length_that_contradicts_the_file_is_refused(tmp_path):
    path = written(tmp_path / "body.uff")
    assert read_uff_geometry(path, "m").nodes.size == 2
    with pytest.raises(InputError, match="states a length of 1 m"):
        read_uff_geometry(path, "mm")
    with pytest.raises(InputError, match="has no nodes"):
        read_uff_geometry(MODE)


def frf(response, direction, node, along):
    lines = np.array([1.0, 2.0])
    return UffFunction(lines, lines + 0j, 4, response, direction, node, along)


def test_functions_and_geometry_make_the_position_sheets(tmp_path):
    geometry = read_uff_geometry(TESTLAB)
    functions = [frf(1, f"+{axis}", node, "-z") for node in (7, 8) for axis in "xyz"]
    sensors, impacts = placed_at_nodes(geometry, functions)
    assert [(row.sensor, row.node) for row in sensors] == [("N1", 1)]
    np.testing.assert_allclose(sensors[0].orientation, geometry.orientations[0], atol=1e-12)
    assert [row.impact for row in impacts] == ["N7 -z", "N8 -z"]
    np.testing.assert_allclose(impacts[0].direction, -geometry.orientations[6][:, 2])
    upright = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
    turned = replace(geometry, orientations=np.broadcast_to(upright, (36, 3, 3)))
    standing = placed_at_nodes(turned, functions)[0][0]
    np.testing.assert_allclose(standing.orientation, upright, atol=1e-12)
    path = tmp_path / "positions.xlsx"
    write_positions(path, sensors, impacts)
    assert [row.node for row in read_table(path, PlacedSensor)] == [1]
    read = read_table(path, PlacedImpact)
    np.testing.assert_allclose(read[1].position, geometry.positions[7], atol=1e-9)
    with pytest.raises(InputError, match="node 99 is not in the geometry"):
        placed_at_nodes(geometry, [frf(99, "+x", 7, "-z")])
    with pytest.raises(InputError, match="reference node 7 has the direction 'scalar'"):
        placed_at_nodes(geometry, [frf(1, "+x", 7, "scalar")])


def test_a_published_mode_reads_and_reads_back(tmp_path):
    modes = read_uff_modes(MODE)
    assert modes.titles == ("97.0 Hz, ζ 0.0 %",)
    np.testing.assert_allclose(modes.shapes[0, 0], [5.3569e-2, 2.0271e-2, 4.6623e-3])
    write_uff_modes(tmp_path / "again.uff", modes)
    again = read_uff_modes(tmp_path / "again.uff")
    np.testing.assert_allclose(again.shapes, modes.shapes)
    np.testing.assert_allclose(again.frequency, modes.frequency, rtol=2e-6)


def drawn_modes():
    rng = np.random.default_rng(4)
    shapes = rng.normal(size=(2, 3, 3)) + 1j * rng.normal(size=(2, 3, 3))
    return UffModes(np.array([23.7, 31.2]), np.array([0.028, 0.4]), np.array([1, 7, 9]), shapes)


def test_complex_modes_read_back_with_their_damping(tmp_path):
    modes = drawn_modes()
    write_uff_modes(tmp_path / "modes.uff", replace(modes, shapes=modes.shapes))
    again = read_uff_modes(tmp_path / "modes.uff")
    np.testing.assert_allclose(again.frequency, modes.frequency, rtol=1e-5)
    np.testing.assert_allclose(again.damping, modes.damping, rtol=1e-5)
    np.testing.assert_allclose(again.shapes, modes.shapes, atol=1e-5)
    assert again.nodes.tolist() == [1, 7, 9]
    with pytest.raises(InputError, match="a frequency above 0 and a damping ratio below 1"):
        write_uff_modes(tmp_path / "no.uff", replace(modes, damping=np.array([0.1, 1.0])))
    assert not (tmp_path / "no.uff").exists()
    with pytest.raises(InputError, match="has no modes"):
        read_uff_modes(TESTLAB)


def test_modes_that_would_fill_the_memory_are_refused(tmp_path, monkeypatch):
    write_uff_modes(tmp_path / "modes.uff", drawn_modes())
    monkeypatch.setattr("deboom.files.disk.MOST_NUMBERS", 35)
    with pytest.raises(InputError, match="modes at all nodes of the file announces 36 numbers"):
        read_uff_modes(tmp_path / "modes.uff")


def test_files_of_too_many_or_too_large_sets_are_refused(tmp_path, monkeypatch):
    write_uff_modes(tmp_path / "modes.uff", drawn_modes())
    monkeypatch.setattr("deboom.files.uff.LARGEST_TEXT", 1000)
    with pytest.raises(InputError, match="MiB of data sets 55, at most 0 MiB are read"):
        read_uff_modes(tmp_path / "modes.uff")
    monkeypatch.setattr("deboom.files.uff.MOST_SETS", 2)
    with pytest.raises(InputError, match=r"modes.uff: there are more than 2 data sets"):
        read_uff_modes(tmp_path / "modes.uff")


class Model:
    """What `modes_at_nodes` reads of a modal model."""

    def __init__(self, shapes):
        self.shapes, self.clusters = shapes, range(len(shapes))
        self.outputs = tuple(f"channel {n}" for n in range(shapes.shape[1]))
        self.frequency, self.damping = np.array([10.0]), np.array([0.02])


def test_outputs_of_a_modal_model_go_to_their_nodes_with_their_sign():
    model = Model(np.array([[1.0 + 0j, 2.0, 3.0]]))
    dofs = [Dof("a", 5, "+z"), Dof("b", 2, "-x"), Dof("c", 5, "+y")]
    modes = modes_at_nodes(model, dofs)
    assert modes.nodes.tolist() == [2, 5]
    np.testing.assert_allclose(modes.shapes[0], [[-2, 0, 0], [0, 3, 1]])
    with pytest.raises(InputError, match="2 nodes do not fit 3 outputs"):
        modes_at_nodes(model, dofs[:2])
    with pytest.raises(InputError, match="output 'c' at node 5 \\+z"):
        modes_at_nodes(model, [*dofs[:2], Dof("c", 5, "+z")])


def test_shapes_move_along_the_axes_of_their_nodes_and_are_drawn_on_the_trace_lines():
    geometry = read_uff_geometry(TESTLAB)
    shapes = np.zeros((1, 2, 3), dtype=complex)
    shapes[0, :, 0] = 1.0
    modes = UffModes(np.array([5.0]), np.array([0.01]), geometry.nodes[[0, 7]], shapes)
    motion = modes.on(geometry)
    np.testing.assert_allclose(motion[0, 0], geometry.orientations[0][:, 0])
    np.testing.assert_allclose(motion[0, 7], geometry.orientations[7][:, 0])
    assert not motion[0, 1:7].any()
    body = plot.BodyMotion(
        labels=[str(node) for node in geometry.nodes],
        positions=geometry.positions,
        normals=np.zeros_like(geometry.positions),
        titles=modes.titles,
        motion=motion,
        traces=geometry.traces,
    )
    assert plot.mode_shapes(body).startswith(b"\x89PNG")
    with pytest.raises(InputError, match="a trace goes to a point that is not there"):
        plot.mode_shapes(replace(body, traces=((0, 36),)))
    with pytest.raises(InputError, match="node 99 is not in the geometry"):
        replace(modes, nodes=np.array([1, 99])).on(geometry)
