"""What can be wrong with what a fit is given; failures of the mathematics itself are statuses (fit.Status)."""


class DataError(ValueError):
    """Too few poses, a missing column, shapes that disagree; the message says what, where, value and remedy."""
