import csv
import io
import json
import math

import numpy as np
import pytest

from logpose.pipelines.report.tables import Column, format_cell, render_table

ROWS = [{"name": "W1", "d_m": 0.0781025}, {"name": "a|b & 50%", "d_m": None}, {"name": "c_d"}]
COLUMNS = [Column("name", "way point"), Column("d_m", "distance [m]", 3)]


def test_markdown_rounds_aligns_numbers_right_and_escapes_bars():
    assert render_table(ROWS, COLUMNS, "markdown") == (
        "| way point  | distance [m] |\n"
        "| ---------- | -----------: |\n"
        "| W1         |        0.078 |\n"
        "| a\\|b & 50% |            – |\n"
        "| c_d        |            – |\n"
    )


def test_latex_is_a_tabular_with_its_special_letters_escaped():
    text = render_table(ROWS, COLUMNS, "latex")
    assert text.startswith("\\begin{tabular}{lr}\n\\hline\nway point & distance [m] \\\\\n")
    assert "a|b \\& 50\\% & -- \\\\" in text
    assert "c\\_d" in text
    assert text.endswith("\\end{tabular}\n")


def test_csv_keeps_all_digits_and_reads_back():
    rows = list(csv.DictReader(io.StringIO(render_table(ROWS, COLUMNS, "csv"))))
    assert [row["name"] for row in rows] == ["W1", "a|b & 50%", "c_d"]
    assert (float(rows[0]["d_m"]), rows[1]["d_m"]) == (0.0781025, "")


def test_json_has_null_where_there_is_no_number():
    rows = json.loads(render_table([{"d_m": math.nan}, {"d_m": np.float64(1.5)}], [COLUMNS[1]], "json"))
    assert rows == [{"d_m": None}, {"d_m": 1.5}]


def test_a_table_without_rows_still_has_its_head():
    assert render_table([], COLUMNS, "csv") == "name,d_m\n"
    assert render_table([], COLUMNS, "markdown").count("\n") == 2


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [
        (-0.0001, 2, "0.00"),
        (-0.01, 2, "-0.01"),
        (0.1, None, "0.1"),
        (True, None, "yes"),
        (3, 2, "3"),
        (math.inf, 2, "–"),
    ],
)
def test_cells_are_written_for_readers(value, digits, text):
    assert format_cell(value, digits) == text


def test_two_columns_of_one_key_are_refused():
    with pytest.raises(ValueError, match="two columns of one key"):
        render_table(ROWS, [COLUMNS[0], COLUMNS[0]], "csv")


def test_an_unknown_format_is_refused():
    with pytest.raises(ValueError, match="unknown table format 'word'"):
        render_table(ROWS, COLUMNS, "word")
