import json
import os
import subprocess
import sys

import pytest

from logpose.cli.main import COMMANDS


def test_help_lists_every_command_and_the_exit_statuses(logpose):
    done = logpose("--help")
    assert done.status == 0
    for name in COMMANDS:
        assert name in done.out
    assert "3 written but data was lost" in done.out.replace("\n ", "")


def test_no_command_prints_the_help_on_stderr_and_is_a_usage_error(logpose):
    done = logpose()
    assert (done.status, done.out) == (2, "")
    assert "Usage: logpose" in done.err


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (["localise-pf"], "logpose: no subcommand 'localise-pf'. Did you mean 'localize-pf'? See logpose --help.\n"),
        (
            ["qqq"],
            f"logpose: no subcommand 'qqq'. There is: {', '.join(COMMANDS)}. See logpose --help.\n",
        ),
        (
            ["localize-pf", "--mapp", "x"],
            (
                "logpose localize-pf: no such option '--mapp'. Did you mean '--map' or '--stamp'? "
                "See logpose localize-pf --help.\n"
            ),
        ),
        (
            ["localize-pf", "x.mcap", "--set", "particles=3", "--map", "m.yaml"],
            "--set particles: no stage named. Write STAGE.PARAMETER=VALUE.\n",
        ),
        (
            ["localize-pf", "x.mcap", "--set", "localize-pf.particels=3", "--map", "m.yaml"],
            "--set: localize-pf has no parameter 'particels'. Did you mean 'particles'?\n",
        ),
        (
            ["localize-pf", "x.mcap", "--topic", "imgae=/a", "--map", "m.yaml"],
            (
                "--topic imgae=/a: no role 'imgae'. There is: camera_info, image, imu, initial_pose, joints, odometry, "
                "pose, range, scan, sightings, true_sightings, truth.\n"
            ),
        ),
        (["localize-pf", "x.mcap", "--map", "m.yaml"], "x.mcap: no such file or folder. Check the path.\n"),
        (["run", "nowhere.yaml", "x.mcap"], "nowhere.yaml: no such file. Check the path.\n"),
        (
            ["localize-pf", "--map", "m.yaml"],
            "localize_pf.yaml: no log given. Name a bag, an MCAP file or a folder of images.\n",
        ),
    ],
)
def test_a_wrong_word_is_one_line_on_stderr(logpose, words, line):
    done = logpose(*words)
    assert done.out == ""
    assert done.err == line
    assert done.status == (1 if "no such file" in line else 2)


def test_errors_are_json_too_when_json_was_asked_for(logpose):
    done = logpose("localize-pf", "x.mcap", "--map", "m.yaml", "--json")
    assert json.loads(done.out) == {
        "error": {"message": "x.mcap: no such file or folder. Check the path.", "exit_status": 1}
    }


def test_traceback_is_shown_only_when_asked_for(logpose):
    assert "Traceback" not in logpose("inspect", "x.mcap").err
    assert "Traceback" in logpose("inspect", "x.mcap", "--traceback").err


@pytest.mark.parametrize("words", [["--help"], ["localize-pf", "--help"], ["--version"]])
def test_help_imports_no_heavy_library(words):
    code = (
        "import sys\nfrom logpose.cli.main import call\n"
        f"call({words!r})\n"
        "heavy = {'numpy', 'cv2', 'scipy', 'numba', 'matplotlib', 'pydantic', 'rosbags', 'mcap', 'rich'}\n"
        "print('HEAVY', sorted(heavy & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "HEAVY []" in done.stdout


def test_a_reader_that_goes_away_ends_the_program_quietly():
    read_end, write_end = os.pipe()
    os.close(read_end)
    words = [sys.executable, "-m", "logpose", "run", "--schema"]
    done = subprocess.run(words, stdout=write_end, stderr=subprocess.PIPE, text=True, check=False)
    os.close(write_end)
    assert (done.returncode, done.stderr) == (141, "")


def test_run_as_a_module_gives_the_exit_status_to_the_shell():
    done = subprocess.run(
        [sys.executable, "-m", "logpose", "inspect", "nowhere"], capture_output=True, text=True, check=False
    )
    assert done.returncode == 1
    assert done.stderr == "nowhere: no such file or folder. Check the path.\n"
