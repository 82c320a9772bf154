"""Another package with the name of one of our folders is named, before anything of it is run."""

import subprocess
import sys

import pytest

import calibeam


def test_our_own_folders_are_found_next_to_the_program():
    calibeam.check_folders()


@pytest.mark.parametrize("name", calibeam.FOLDERS)
def test_a_folder_of_the_same_name_that_comes_first_is_named_in_one_sentence(tmp_path, name):
    (tmp_path / name).mkdir()
    (tmp_path / name / "__init__.py").write_text("raise SystemExit('ran')")
    command = [sys.executable, "-m", "calibeam", "--version"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert done.stderr.startswith(f"error: {name} is found in {tmp_path.resolve()}, not beside calibeam")
    assert "Traceback" not in done.stderr
