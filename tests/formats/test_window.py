import pytest

from logpose.formats.errors import ConfigError
from logpose.formats.window import Bound, Window, parse_window

S = 1_000_000_000


@pytest.mark.parametrize(
    ("text", "bound"),
    [
        ("0", Bound(0)),
        ("12.5", Bound(12_500_000_000)),
        ("12.5s", Bound(12_500_000_000)),
        ("0.000000001", Bound(1)),
        ("1700000000", Bound(1_700_000_000 * S, is_relative=False)),
        ("1700000000.123456789", Bound(1_700_000_000_123_456_789, is_relative=False)),
        ("1700000000123456789", Bound(1_700_000_000_123_456_789, is_relative=False)),
        ("5000ns", Bound(5000, is_relative=False)),
    ],
)
def test_times_are_read_to_the_nanosecond(text, bound):
    assert parse_window(text, None, None) == Window(bound, None)


def test_a_duration_ends_the_window():
    assert parse_window("2", None, "1.5") == Window(Bound(2 * S), Bound(3 * S + S // 2))
    assert parse_window(None, None, "3") == Window(None, Bound(3 * S))
    assert parse_window("1700000000", None, "1").end == Bound(1_700_000_001 * S, is_relative=False)


def test_no_option_is_no_window():
    assert parse_window(None, None, None) is None


def test_bounds_are_resolved_against_the_first_stamp():
    window = Window(Bound(5), Bound(700, is_relative=False))
    assert window.resolve(100) == (105, 700)
    assert Window().resolve(100) == (None, None)


@pytest.mark.parametrize(
    ("start", "end", "duration", "message"),
    [
        ("x", None, None, "--start: 'x' is not a time. Give seconds from the start, like 12.5, or a stamp."),
        (None, "-1", None, "--end: '-1' is not a time. Give seconds from the start, like 12.5, or a stamp."),
        ("5", "5", None, "--end: '5' is not after --start '5'. Give a later end."),
        (None, "1", "1", "--end and --duration: only one of them can end the window. Leave one out."),
        (None, None, "0", "--duration: '0' is not a duration. Give seconds, like 30 or 2.5."),
    ],
)
def test_errors_say_what_to_do(start, end, duration, message):
    with pytest.raises(ConfigError) as error:
        parse_window(start, end, duration)
    assert str(error.value) == message
