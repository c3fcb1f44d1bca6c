"""The stored lenses of the foveae: their description and addresses. It imports no fitting code."""

from pydantic import BaseModel

from foveacam_hardware.contract import Role
from foveacam_server.resources.calibrating.sessions.schema import LensDocument, eye_of
from foveacam_server.resources.calibrating.sessions.sessions import CalibrationSession, SessionFile
from foveacam_server.resources.calibrating.sessions.wide_stage import views_id

EYES = (Role.LEFT, Role.RIGHT)


class LensResult(BaseModel):
    """The lens of a fovea. `views_id`: of the views that it was computed from."""

    views_id: str
    lens: LensDocument


def lens_file(role: Role) -> SessionFile[LensResult]:
    """Return the file of a fovea's lens."""
    return SessionFile(name=f"{role.value}-lens-result.json", schema=LensResult)


def describe_lens(session: CalibrationSession, role: Role, *, url: str) -> LensDocument | None:
    """Return a fovea's lens document; None before any view was taken.

    While views are being taken the newest are returned without a fit.
    """
    views = f"{role.value}.json"
    if not (session.folder / views).is_file():
        return None
    found = session.read(lens_file(role))
    if found is None or found.views_id != views_id(session.folder, views):
        from foveacam_server.resources.calibrating.sessions.lens_step import (
            unfitted_lens,  # board detection is slow to import
        )

        lens = unfitted_lens(session.folder, role)
    else:
        lens = found.lens
    base = f"{url}/lenses/{eye_of(role)}/samples"
    samples = [
        sample.model_copy(update={"thumbnail_url": f"{base}/{sample.id}.jpg"}) for sample in lens.samples
    ]
    return lens.model_copy(update={"samples": samples})
