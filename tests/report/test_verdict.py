import pytest

from logpose.formats.events import Notice, Summary
from logpose.pipelines.report.verdict import length, verdict


def test_the_sentence_says_what_how_wrong_and_how_sure(findings):
    sentence = verdict(findings)
    rmse = findings.evaluation["ate"]["rmse_m"]
    assert sentence.startswith("localize-pf estimated 1200 poses over 103.5 s and 133.")
    assert f"against the truth it is {100 * rmse:.1f} cm off" in sentence
    assert "its status is tracking for " in sentence
    assert sentence.endswith(".")


def test_it_does_not_claim_to_know_an_error_without_truth(collect, odd_runs):
    assert verdict(collect(odd_runs["east"])) == (
        "localize-pf estimated 300 poses over 29.9 s and 149.5 m of way; the truth is not known, so neither is the "
        "error; its status is lost for 100.0 %."
    )
    assert "no pose could be compared with the truth" in verdict(collect(odd_runs["truth of another day"]))


def test_without_an_evaluation_the_error_is_computed(collect, make):
    events = [make.pose(i * 10**8, float(i), y, 0.0, s) for i in range(5) for y, s in ((0.0, "truth"), (0.5, "a"))]
    assert "0.50 m off (RMSE; at most 0.50 m) and 0.00° in heading" in verdict(collect(events))


def test_poses_that_could_not_be_compared_are_told(collect, make):
    values = {"ate": {"rmse_m": 0.02, "max_m": 0.1, "rmse_rad": 0.01}, "matched": 7, "estimate_total": 9}
    events = [
        make.pose(1, 0.0, 0.0, 0.0),
        make.pose(2, 0.0, 0.0, 0.0),
        Summary(stamp=2, source="evaluation", values=values),
    ]
    found = verdict(collect(events))
    assert "2.0 cm off (RMSE; at most 0.10 m) and 0.57° in heading, known for 7 of 9 poses" in found


def test_sightings_alone_are_counted(collect, odd_runs):
    assert verdict(collect(odd_runs["sightings only"])) == "detect-circles saw 73 landmarks in 50 images, none in 13."
    assert verdict(collect([])) == "No pose was estimated."


def test_warnings_and_losses_are_counted_by_code(collect, make):
    notices = [Notice(stamp=i, code=code, message="m", is_loss=code == "b") for i, code in enumerate("aab")]
    assert verdict(collect([make.pose(1, 0.0, 0.0, 0.0), *notices])).endswith("; 2 warnings (1 of lost data).")


@pytest.mark.parametrize(
    ("metres", "text"),
    [
        (0.00012, "0.12 mm"),
        (0.0034, "0.34 cm"),
        (0.066334, "6.6 cm"),
        (0.0996, "0.10 m"),
        (1.2345, "1.23 m"),
        (133.74, "133.7 m"),
    ],
)
def test_lengths_have_the_unit_a_person_would_use(metres, text):
    assert length(metres) == text


def test_an_alignment_is_told_and_another_estimators_error_is_not_claimed(collect, make):
    values = {"source": "a", "ate": {"rmse_m": 0.02, "max_m": 0.1}, "alignment": {"method": "se2"}}
    end = Summary(stamp=2, source="evaluation", values=values)
    assert "2.0 cm off (RMSE; at most 0.10 m) after se2 alignment" in verdict(
        collect([make.pose(1, 0, 0, 0, "a"), end])
    )
    assert "the truth is not known" in verdict(collect([make.pose(1, 0, 0, 0, "b"), end]))
