"""The server's registers: which addresses there are, which of them may be written."""

from collections.abc import Callable, Iterable, Sequence

HOLDING, INPUT = "holding", "input"
Listener = Callable[[int, int], None]  # address, word


class Memory:
    """Two tables of 16-bit registers; an address that the map does not cover does not exist."""

    def __init__(self) -> None:
        self._words: dict[str, dict[int, int]] = {HOLDING: {}, INPUT: {}}
        self._writable: set[int] = set()
        self.on_write: list[Listener] = []

    def define(self, table: str, addresses: Iterable[int], *, writable: bool = False) -> None:
        """Registers with the value zero, as after power-on."""
        for address in addresses:
            self._words[table].setdefault(address, 0)
            if writable:
                self._writable.add(address)

    def put(self, table: str, address: int, words: Sequence[int]) -> None:
        """From the controller's side."""
        self._words[table].update(zip(range(address, address + len(words)), words, strict=True))

    def get(self, table: str, address: int, count: int) -> list[int] | None:
        """None when an address is not there."""
        table_words = self._words[table]
        words = [table_words.get(at) for at in range(address, address + count)]
        return None if None in words else [word for word in words if word is not None]

    def write(self, address: int, words: Sequence[int]) -> bool:
        """From a client; all or nothing. False when an address is not there, or is not the client's to write."""
        if not all(at in self._writable for at in range(address, address + len(words))):
            return False
        self.put(HOLDING, address, words)
        for at, word in zip(range(address, address + len(words)), words, strict=True):
            for listener in self.on_write:
                listener(at, word)
        return True
