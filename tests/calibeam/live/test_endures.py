"""Ten minutes of a page on 30 Hz without growth."""

import shutil

import pytest

from benchmarks.live_endured import watched

PAGE_PER_MIN = 50e3  # 30 MB in a shift of ten hours; a message kept would be 2 MB/min
SERVER_PER_MIN = 200e3  # allocator noise of the test's own process is below 100 kB/min


@pytest.mark.endure
def test_a_page_open_for_ten_minutes_does_not_grow(rig) -> None:
    if shutil.which("chromium") is None:
        pytest.skip("no chromium on the PATH (Debian: apt-get install chromium); the live page is not looked at")
    grown = watched(rig)
    print(grown.line)
    assert grown.page_per_min < PAGE_PER_MIN, grown.line
    assert grown.server_per_min < SERVER_PER_MIN, grown.line
