"""The cells that tell a pixel which shapes can touch it."""

import numpy as np

from logpose.pipelines.simulate.shapes import CELL_M, DISC, HEXAGON, RECTANGLE, Drawing, Glow, Shape


def listed(tables, x, y, which):
    side, columns, rows, *lists = tables[1]
    cell = min(int(y / side), rows - 1) * columns + min(int(x / side), columns - 1)
    starts, items = lists[2 * which], lists[2 * which + 1]
    return items[starts[cell] : starts[cell + 1]].tolist()


def test_every_point_of_a_shape_lists_it_in_drawing_order():
    rng = np.random.default_rng(0)
    shapes = [Shape(DISC, *rng.uniform(0.2, 3.8, 2).tolist(), 0.3, 0.3, 1.0) for _ in range(40)]
    tables = Drawing(shapes).tables(np.array([4.0, 4.0]))
    for x, y in rng.uniform(0, 4, (300, 2)):
        inside = [i for i, s in enumerate(shapes) if np.hypot(s.x - x, s.y - y) < 0.15]
        found = listed(tables, x, y, 0)
        assert set(inside) <= set(found)
        assert found == sorted(found)


def test_a_shape_over_the_border_is_kept():
    tables = Drawing([Shape(RECTANGLE, 0.0, 0.0, 0.5, 0.5, 1.0)], [Glow(4.0, 4.0, 0.1, 1, 1, 0.5)]).tables(
        np.array([4.0, 4.0])
    )
    assert listed(tables, 0.0, 0.0, 0) == [0]
    assert listed(tables, 3.99, 3.99, 1) == [0]
    assert listed(tables, 2.0, 2.0, 0) == []


def test_an_empty_drawing_has_empty_cells():
    bars, cells, shapes, glows = Drawing().tables(np.array([1.0, 0.5]))
    assert bars[1] == 0
    assert cells[1:3] == (int(np.ceil(1 / CELL_M)), int(np.ceil(0.5 / CELL_M)))
    assert shapes.shape == (0, 11)
    assert glows.shape == (0, 6)


def test_reach_holds_the_whole_shape():
    assert Shape(RECTANGLE, 0, 0, 0.3, 0.4, 1).reach == 0.25
    assert Shape(HEXAGON, 0, 0, 1.0, 1.0, 1).reach > 1 / 3**0.5
