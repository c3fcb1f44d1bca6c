"""A fixation that shows itself in a notebook: distance, pictures and point cloud, stored in the output."""

from typing import Self

from pydantic import PrivateAttr

from foveacam_client.fixation_view import FixationView, read_view
from foveacam_client.generated import models
from foveacam_client.server_source import ServerSource


class FixationResult(models.FixationDocument):
    """A fixation's document; a notebook shows its distance, pictures and point cloud."""

    _source: ServerSource = PrivateAttr(default_factory=ServerSource)
    _view: FixationView | None = PrivateAttr(default=None)

    def read_from(self, source: ServerSource) -> Self:
        """Read pictures and cloud from a server when they are shown; return this fixation."""
        self._source = source
        return self

    def _repr_html_(self) -> str:
        return self._read_view().html(self)

    def _repr_png_(self) -> bytes | None:
        return self._read_view().png()

    def _read_view(self) -> FixationView:
        if self._view is None:
            self._view = read_view(self, self._source)
        return self._view
