"""Routes of clouds: the point cloud of each fixation, as PLY, GLB and a picture."""

from typing import Annotated, Protocol

from fastapi import Path

from foveacam_server.accounts.rights import Right
from foveacam_server.accounts.route_rights import GuardedRouter, needs
from foveacam_server.foundation.http.answers import Limit, problems
from foveacam_server.foundation.http.provided import Provided
from foveacam_server.foundation.http.stored_file import StoredFile, stored_file_responses
from foveacam_server.resources.looking.clouds.collection import CloudCollection
from foveacam_server.resources.looking.clouds.schema import CloudDocument
from foveacam_server.rig.ports import SceneViewer

router = GuardedRouter("/clouds", tags=["clouds"], reading=Right.VIEW, changing=Right.OPERATE)


class CloudOwners(Protocol):
    """The fixations, each of which names its newest cloud."""

    def remove_cloud(self, fixation_id: str, *, left: CloudDocument | None) -> None:
        """Make the fixation and its target name `left`, the newest remaining cloud, or none."""
        ...


CloudId = Annotated[str, Path(pattern=r"^cld-[0-9a-f]{1,32}$")]


@router.get("", summary="Newest clouds, newest first")
def newest(clouds: Provided[CloudCollection], limit: Limit = 50) -> list[CloudDocument]:
    """Return the newest clouds."""
    return clouds.newest(limit)


@router.get(
    "/{cloud_id}.ply",
    summary="Points as PLY",
    response_class=StoredFile,
    responses=stored_file_responses("application/octet-stream"),
)
def ply(cloud_id: CloudId, clouds: Provided[CloudCollection]) -> StoredFile:
    """Return x, y, z (m, rig frame), colour and sigma of every point."""
    path = clouds.file(cloud_id, "cloud.ply")
    return StoredFile(path, media_type="application/octet-stream", filename=f"{cloud_id}.ply")


@router.get(
    "/{cloud_id}.glb",
    summary="Textured surface as GLB",
    response_class=StoredFile,
    responses=stored_file_responses("model/gltf-binary"),
)
def glb(cloud_id: CloudId, clouds: Provided[CloudCollection]) -> StoredFile:
    """Return the textured mesh, in metres, +y up."""
    path = clouds.file(cloud_id, "mesh.glb")
    return StoredFile(path, media_type="model/gltf-binary", filename=f"{cloud_id}.glb")


@router.get(
    "/{cloud_id}/depth.png",
    summary="Depth as a picture",
    response_class=StoredFile,
    responses=stored_file_responses("image/png"),
)
def depth_png(cloud_id: CloudId, clouds: Provided[CloudCollection]) -> StoredFile:
    """Return depth as colours with a scale."""
    return StoredFile(clouds.file(cloud_id, "depth.png"), media_type="image/png")


@router.get("/{cloud_id}", summary="One cloud", responses=problems(404))
def one(cloud_id: CloudId, clouds: Provided[CloudCollection]) -> CloudDocument:
    """Return one cloud."""
    return clouds.get(cloud_id)


@router.delete("/{cloud_id}", status_code=204, summary="Remove a cloud", responses=problems(404))
@needs(Right.ADMINISTER)
def remove(
    cloud_id: CloudId,
    clouds: Provided[CloudCollection],
    fixations: Provided[CloudOwners],
    viewer: Provided[SceneViewer | None],
) -> None:
    """Remove a cloud and its files; fixation and target stay, with an earlier cloud if there is one."""
    cloud = clouds.remove(cloud_id)
    fixations.remove_cloud(cloud.fixation_id, left=clouds.of_fixation(cloud.fixation_id))
    if viewer is not None:
        viewer.remove_fixation(cloud.fixation_id)
