import numpy as np
import pytest

from logpose.pipelines.report.drawing import drawing
from logpose.pipelines.report.errors import draw_errors


def test_errors_have_units_and_the_band_of_the_covariance(findings):
    with drawing():
        axes = draw_errors(findings).axes
    labels = [a.get_ylabel() for a in axes]
    assert labels == ["distance from\nthe truth [m]", "x error [m]", "y error [m]", "heading error [°]"]
    assert axes[0].get_yscale() == "log"
    assert axes[-1].get_xlabel() == "time since the start [s]"
    band = axes[3].collections[0].get_datalim(axes[3].transData)
    largest = 3 * np.degrees(np.sqrt(findings.primary.covariance[:, 2, 2].max()))
    assert (band.y0, band.y1) == (pytest.approx(-largest), pytest.approx(largest))


def test_without_truth_there_is_no_picture_of_errors(collect, odd_runs):
    with drawing():
        assert draw_errors(collect(odd_runs["east"])) is None
        assert draw_errors(collect(odd_runs["truth of another day"])) is None


def test_long_logs_have_a_time_axis_in_minutes(collect, make):
    long = collect([make.pose(0, 0.0, 0.0, 0.0), make.pose(3601 * 10**9, 1.0, 0.0, 0.0)])
    assert long.time_unit == ("min", 60e9)


def test_errors_are_not_drawn_where_nothing_was_estimated(collect, make):
    """At 10 Hz for a second, then nothing for twenty, then again."""
    stamps = [i * 10**8 for i in range(10)] + [21 * 10**9 + i * 10**8 for i in range(10)]
    events = [make.pose(i * 10**8, 0.1 * i, 0.0, 0.0, "truth") for i in range(230)]
    events += [make.pose(stamp, stamp / 1e9, 0.02, 0.01, covariance=np.eye(6) * 1e-4) for stamp in stamps]
    with drawing():
        rows = draw_errors(collect(events)).axes
    for axes, label in zip(rows, ("localize-pf", "error", "error", "error"), strict=True):
        (line,) = [line for line in axes.lines if line.get_label() == label]
        assert np.isnan(line.get_ydata()).sum() == 1


def test_a_pause_in_a_long_series_is_kept(collect, make):
    stamps = [i * 10**8 for i in range(3000)] + [400 * 10**9 + i * 10**8 for i in range(3000)]
    events = [make.pose(i * 10**9 // 2, 0.05 * i, 0.0, 0.0, "truth") for i in range(1500)]
    events += [make.pose(stamp, stamp / 1e10, 0.02, 0.01) for stamp in stamps]
    with drawing():
        rows = draw_errors(collect(events)).axes
    for axes in rows:
        assert any(np.isnan(np.asarray(line.get_ydata(), dtype=float)).any() for line in axes.lines)
