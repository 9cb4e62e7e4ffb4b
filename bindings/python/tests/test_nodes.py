"""Surfaces that the nodes of a volume move."""

import itertools

import numpy as np
import pytest

import dibs


def lattice(low, high, cells):
    """Nodes and tetrahedra of a box of cells, six to each."""
    axes = [np.linspace(low[i], high[i], cells[i] + 1) for i in range(3)]
    nodes = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)
    size = np.array(cells) + 1

    def number(point):
        return (point[0] * size[1] + point[1]) * size[2] + point[2]

    tetrahedra = []
    for cell in itertools.product(*map(range, cells)):
        for order in itertools.permutations(range(3)):
            corners = [np.array(cell)]
            for axis in order:
                corners.append(corners[-1] + np.eye(3, dtype=int)[axis])
            four = [number(corner) for corner in corners]
            if order not in [(0, 1, 2), (1, 2, 0), (2, 0, 1)]:
                four[2], four[3] = four[3], four[2]
            tetrahedra.append(four)
    return nodes, np.array(tetrahedra)


@pytest.fixture(scope="module")
def heart():
    mesh, _ = dibs.generate("heart", 1_000)
    nodes, tetrahedra = lattice(mesh.vertices.min(0) - 1, mesh.vertices.max(0) + 1, (3, 3, 4))
    return mesh, nodes, tetrahedra


def test_nodes_move_the_surface(heart):
    mesh, nodes, tetrahedra = heart
    tree = dibs.build(mesh, nodes=nodes, tetrahedra=tetrahedra, stretch=1.3)
    assert tree.summary["volume"]["nodes"] == len(nodes)
    plain = dibs.build(mesh, stretch=1.3)
    matrix = np.array([[1.05, 0.0, 0.1], [0.0, 0.98, 0.0], [0.0, 0.05, 1.0]])
    for change in (np.eye(3), matrix):
        surface = tree.surface(nodes @ change.T)
        assert surface.stretch == pytest.approx(np.linalg.svd(change)[1].max(), abs=1e-4)
        beside = plain.surface(mesh.vertices @ change.T)
        tools = [dibs.spheres((90.0, 10.0, 20.0), 5.0), dibs.spheres((0.0, 0.0, 150.0), 5.0)]
        for tool in tools:
            one, other = surface.query(tool), beside.query(tool)
            assert one["separation"] == pytest.approx(other["separation"], abs=2e-3)
            assert one["coverage"] == dibs.Coverage.MEASURED
    assert dibs.Tree(tree.blob).rest.query(tools[0])["separation"] == tree.query(tools[0])["separation"]


def test_what_is_no_volume_is_refused(heart):
    mesh, nodes, tetrahedra = heart
    tree = dibs.build(mesh, nodes=nodes, tetrahedra=tetrahedra)
    with pytest.raises(ValueError, match="has 5 points and the tree has 80 nodes"):
        tree.surface(nodes[:5])
    with pytest.raises(ValueError, match="is stretched by"):
        tree.surface(nodes * [1, 1, 1.6])
    with pytest.raises(ValueError, match="inverted or flat"):
        tree.surface(nodes * [1, 1, -1])
    with pytest.raises(TypeError, match="go together"):
        dibs.build(mesh, nodes=nodes)
    with pytest.raises(ValueError, match="N x 4 integers"):
        dibs.build(mesh, nodes=nodes, tetrahedra=tetrahedra[:, :3])
    with pytest.raises(ValueError, match="number 2 has node 80, and there are 80"):
        wrong = tetrahedra.copy()
        wrong[2, 1] = 80
        dibs.build(mesh, nodes=nodes, tetrahedra=wrong)
    with pytest.raises(ValueError, match="inverted at rest"):
        dibs.build(mesh, nodes=nodes, tetrahedra=tetrahedra[:, [1, 0, 2, 3]])
    with pytest.raises(ValueError, match="outside the volume"):
        dibs.build(mesh, nodes=nodes + 50.0, tetrahedra=tetrahedra)
