"""An action of a program beside the stream: a hand takes its time, and the arm goes on being told where to stand.

On a belt it has to: an arm whose set-points stop stands, and the belt takes the part away from the hand.
"""

import threading
from collections.abc import Callable

Acting = Callable[[str], None]


class Action:
    """One GRASP or RELEASE under way. A motion that is ended meanwhile does not wait for it."""

    def __init__(self, act: Acting, name: str) -> None:
        self._act, self._name = act, name
        self._failure: BaseException | None = None
        self._thread = threading.Thread(target=self._run, name=f"action {name}", daemon=True)
        self._thread.start()

    def over(self) -> bool:
        """Whether it is done. Raises what went wrong in it."""
        if self._thread.is_alive():
            return False
        if self._failure is not None:
            raise self._failure
        return True

    def _run(self) -> None:
        try:
            self._act(self._name)
        except BaseException as failure:  # told to the stream, which stops the arm
            self._failure = failure
