import pytest

from logpose.formats.errors import ConfigError
from logpose.pipelines.evaluate.gate import failed_gates, parse_gate

RESULT = {
    "matched": 12,
    "ate": {"rmse_m": 0.2, "rmse_rad": 0.01, "max_m": 0.5},
    "lost": {"is_lost": False, "longest_s": 3.5},
    "rpe": {"delta": "1f", "rmse_m": None},
    "waypoints": [{"name": "A"}],
}


@pytest.mark.parametrize(
    ("text", "failed"),
    [
        ("ate.rmse>0.10", ["ate.rmse_m is 0.2 (ate.rmse>0.10)"]),
        ("ate.rmse_m > 0.3", []),
        ("ate.rmse_rad>=0.01", ["ate.rmse_rad is 0.01 (ate.rmse_rad>=0.01)"]),
        ("matched<100", ["matched is 12 (matched<100)"]),
        ("matched != 12", []),
        ("lost.longest>1e0", ["lost.longest_s is 3.5 (lost.longest>1e0)"]),
        ("lost.is_lost==1", []),
        ("rpe.rmse>1", ["rpe.rmse_m does not exist (rpe.rmse>1)"]),
    ],
)
def test_a_gate_fails_where_its_condition_holds(text, failed):
    assert failed_gates([parse_gate(text)], RESULT) == failed


@pytest.mark.parametrize("text", ["", "ate.rmse", "ate.rmse>", ">1", "ate.rmse=1", "ate.rmse>1 m", "ate.rmse>1..2"])
def test_what_is_no_condition_is_refused(text):
    with pytest.raises(ConfigError) as caught:
        parse_gate(text)
    assert str(caught.value) == f"--fail-if: {text!r} is no condition. Write one like 'ate.rmse>0.10'."


def test_an_unknown_figure_is_refused_with_those_there_are():
    with pytest.raises(ConfigError) as caught:
        failed_gates([parse_gate("ape.rmse>1")], RESULT)
    assert str(caught.value) == (
        "--fail-if: there is no figure 'ape.rmse'. There are: matched, ate.rmse_m, ate.rmse_rad, ate.max_m, "
        "lost.is_lost, lost.longest_s, rpe.rmse_m."
    )
