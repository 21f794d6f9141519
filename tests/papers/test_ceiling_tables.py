"""The paper's Tables 4 and 5: what is printed, what follows from it, and ours beside it."""

import importlib.util
import json
import math
import statistics

import pytest
import yaml


@pytest.fixture(scope="module")
def script(root):
    import sys

    spec = importlib.util.spec_from_file_location("ceiling_tables", root / "papers" / "ceiling" / "tables.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules["ceiling_tables"] = module
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def paper(root):
    return yaml.safe_load((root / "papers" / "ceiling" / "paper_tables.yaml").read_text())


def test_the_printed_distances_follow_from_the_printed_coordinates_but_for_w1(script, paper):
    run = script.paper_run(paper, is_corrected=False)
    assert run[0].distance == pytest.approx(0.070710678119, abs=1e-12)
    for point, found in list(zip(paper["table4"]["waypoints"], run, strict=True))[1:]:
        assert found.distance == pytest.approx(point["distance_m"], abs=5e-7)  # printed with six digits


def test_with_w1_corrected_all_averages_and_deviations_come_out(script, paper):
    run = script.paper_run(paper, is_corrected=True)
    assert run[0].distance == pytest.approx(0.078102, abs=5e-7)
    corrected = paper["table5"]["corrected"]
    values = {"x_m": [abs(p.dx) for p in run], "y_m": [abs(p.dy) for p in run], "distance_m": [p.distance for p in run]}
    for axis, found in values.items():
        assert statistics.mean(found) == pytest.approx(corrected["average"][axis], abs=5e-7)
        assert statistics.stdev(found) == pytest.approx(corrected["standard_deviation"][axis], abs=5e-7)


def test_the_print_transposed_average_and_deviation(paper):
    printed, corrected = paper["table5"]["printed"], paper["table5"]["corrected"]
    assert printed["average"]["y_m"] == corrected["standard_deviation"]["x_m"] == 0.03559
    assert printed["standard_deviation"]["x_m"] == corrected["average"]["y_m"] == 0.042857


def test_the_mean_and_deviation_of_the_printed_column(paper):
    distances = [point["distance_m"] for point in paper["table4"]["waypoints"]]
    assert statistics.mean(distances) == pytest.approx(0.066334, abs=5e-7)
    assert statistics.stdev(distances) == pytest.approx(0.026452, abs=5e-7)


def run_file(path, errors):
    points = [
        {"name": f"W{i + 1}", "x_m": 0.0, "y_m": 0.0, "estimate_x_m": dx, "estimate_y_m": dy, "dx_m": dx, "dy_m": dy,
         "distance_m": None if dx is None else math.hypot(dx, dy)}
        for i, (dx, dy) in enumerate(errors)
    ]  # fmt: skip
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps({"schema": "logpose.evaluation/1", "result": {"waypoints": points}}))
    return str(path)


def test_ours_stand_beside_the_papers(script, tmp_path, capsys):
    runs = [run_file(tmp_path / f"{i}.json", [(0.03 * sign, 0.04)] * 7) for i, sign in enumerate((1, -1))]
    folder = tmp_path / "run"
    run_file(folder / "report.json", [(0.01, 0.0)] * 7)
    report = json.loads((folder / "report.json").read_text())
    (folder / "report.json").write_text(json.dumps({"result": {"evaluation": report["result"]}}))
    assert script.main(["--paper", *runs, "--best", str(folder), "-o", str(tmp_path)]) == 0
    table4, table5 = (tmp_path / name for name in ("table4.md", "table5.md"))
    assert capsys.readouterr().out == table4.read_text() + "\n" + table5.read_text() + "\n"
    rows = [line for line in table4.read_text().splitlines() if line.startswith("| W1 ")]
    # The mean estimate of +-3 cm, 4 cm is 4 cm off; each run is 5 cm off.
    assert [cell.strip() for cell in rows[0].split("|")[1:-1]] == [
        "W1",
        "30.38, 27.20",
        "0.078102",
        "0.070711",
        "0.0400",
        "0.0100",
    ]
    assert [cell.strip() for cell in rows[1].split("|")[1:-1]] == ["W1", "0.0500 ± 0.0000 [0.0500, 0.0500]", "0.0100"]
    assert "0.040000 |" in table5.read_text()
    assert "changed places" in table5.read_text()


def test_a_missed_way_point_is_left_out_and_told(script, tmp_path, paper):
    runs = [
        run_file(tmp_path / "a.json", [(0.1, 0.0)] * 7),
        run_file(tmp_path / "b.json", [(None, None)] + [(0.3, 0.0)] * 6),
    ]
    text = script.table4(paper, {"ours": script.read_runs(runs)})
    rows = [line.split("|")[-2].strip() for line in text.splitlines() if line.startswith(("| W1", "| W2", "| mean"))]
    assert rows[0] == "–"  # no mean estimate
    assert rows[3] == "0.1000 (n = 1)"
    assert rows[4].startswith("0.2000 ± 0.1414")
    assert rows[5] == "0.1000 (n = 1)"
    assert script.table5(paper, {"ours": script.read_runs(runs)})


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("{", "no evaluation"),
        ("{}", "no evaluation"),
        ('{"result": {}}', "no way points in it"),
        ('{"result": null}', "no way"),
    ],
)
def test_a_file_without_way_points_is_refused_in_one_line(script, tmp_path, capsys, text, words):
    (tmp_path / "a.json").write_text(text)
    assert script.main(["--best", str(tmp_path / "a.json"), "-o", str(tmp_path)]) == 1
    assert words in capsys.readouterr().err
    assert not (tmp_path / "table4.md").exists()


def test_runs_of_different_routes_are_not_mixed(script, tmp_path):
    a = run_file(tmp_path / "a.json", [(0.1, 0.0)] * 7)
    b = run_file(tmp_path / "b.json", [(0.1, 0.0)] * 6)
    with pytest.raises(ValueError, match="other way points than"):
        script.read_runs([a, b])
