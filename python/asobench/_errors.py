"""The errors of the package."""

from __future__ import annotations


class Error(Exception):
    """The base of the errors that have no class of Python's own."""


class EstimateFailed(Error):
    """An estimate without a model.

    Attributes
    ----------
    kind : str
        The kind of failure as results name it, such as ``"rank-deficient"``.
    stage : int
        The stage of the paper's algorithm; 0 of other methods.
    """

    def __init__(self, message: str, kind: str = "", stage: int = 0) -> None:
        super().__init__(message)
        self.kind, self.stage = kind, stage

    def __reduce__(self) -> tuple[object, ...]:
        return type(self), (*self.args, self.kind, self.stage)


class StudyError(Error, RuntimeError):
    """The message of the program ``asobench`` when it refused or failed."""


class Declined(Error):
    """Raised by a method for a record that is not one for it, with a reason or without."""
