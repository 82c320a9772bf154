"""Where a proof keeps what: recordings and answers on one side, seals on the other."""

from dataclasses import dataclass
from pathlib import Path

RECORDED = "recording.mcap"


@dataclass(frozen=True)
class Layout:
    """Folders of a proof under `out`."""

    out: Path

    def recording(self, name: str) -> Path:
        """What a site would hand over: a session folder, or the file that was recorded."""
        folder = self.out / "recordings" / name
        return folder / RECORDED if (folder / RECORDED).is_file() else folder

    def recorded(self, name: str) -> Path:
        """The file of a session that is recorded."""
        return self.out / "recordings" / name / RECORDED

    def asked(self, name: str) -> Path:
        """Poses that nobody measured: where will the tool be?"""
        return self.out / "asked" / f"{name}.csv"

    @property
    def answers(self) -> Path:
        """Where the diagnosing process is at work."""
        return self.out / "answers"

    def answer(self, name: str) -> Path:
        """What the diagnosing process writes."""
        return self.answers / name

    def seal(self, name: str) -> Path:
        """The truth, unreadable."""
        return self.out / "sealed" / f"{name}.bin"

    def revealed(self, name: str) -> Path:
        """The truth, after every case has been diagnosed."""
        return self.out / "revealed" / f"{name}.json"

    @property
    def hashes(self) -> Path:
        """Published before anything is diagnosed."""
        return self.out / "hashes.txt"

    @property
    def proof(self) -> Path:
        return self.out / "proof.json"

    @property
    def page(self) -> Path:
        return self.out / "proof.html"
