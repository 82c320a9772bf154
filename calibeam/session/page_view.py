"""A session on the live page."""

from calibeam.live.feed import Feed
from calibeam.live.feed import Progress as PageProgress
from calibeam.session.status import Shown


class PageView:
    """Implements calibeam.session.status.Listener."""

    def __init__(self, feed: Feed) -> None:
        self._feed = feed
        self._stands: tuple[int, int] | None = None
        self._samples = -1

    def said(self, text: str, loud: bool) -> None:
        if loud:
            self._feed.said(text)

    def shows(self, shown: Shown) -> None:
        progress, forecast = shown.progress, shown.forecast
        if progress is not None and (progress.placement, progress.first) != self._stands:
            self._stands = progress.placement, progress.first
            self._feed.stands(*self._stands)
        if forecast is not None and forecast.corrections is not None and forecast.samples != self._samples:
            self._samples = forecast.samples
            self._feed.believes(forecast.corrections)
        note = shown.asked or ("" if forecast is None else f"accuracy: {forecast.says}")
        done, total = (0, None) if progress is None else (progress.done, progress.total)
        self._feed.progress(PageProgress(shown.head, done, total, shown.left_s, note))
