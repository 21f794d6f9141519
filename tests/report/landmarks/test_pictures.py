import numpy as np

from logpose.pipelines.report.drawing import drawing
from logpose.pipelines.report.landmarks.kept import LandmarkFindings
from logpose.pipelines.report.landmarks.pictures import LARGEST_BIN, draw_histogram, draw_sightings


def test_the_histogram_prints_every_count(findings):
    with drawing():
        axes = draw_histogram(findings).axes[0]
    counts = np.bincount(findings.of(LandmarkFindings).seen.n)
    assert [text.get_text() for text in axes.texts][: len(counts)] == [str(count) for count in counts]
    assert counts.sum() == len(findings.of(LandmarkFindings).seen.n)


def test_a_crowded_image_falls_into_the_last_bar(collect, make):
    with drawing():
        axes = draw_histogram(collect([make.sightings(1, np.zeros((40, 2)))])).axes[0]
    assert axes.get_xticklabels()[-1].get_text() == f"{LARGEST_BIN}+"
    assert axes.texts[-1].get_text() == "1"


def test_blind_images_are_marked_and_counted(findings):
    with drawing():
        figure = draw_sightings(findings)
    blind = int((findings.of(LandmarkFindings).seen.n == 0).sum())
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert f"no landmark in the image ({blind} of {len(findings.of(LandmarkFindings).seen.n)} images)" in labels
