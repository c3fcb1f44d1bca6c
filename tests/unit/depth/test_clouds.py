import errno
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from foveacam_hardware.contract import InvalidInput, StorageFull
from foveacam_pipeline.stereo.values import Cloud, DepthMesh
from foveacam_server.foundation.errors import NotFound
from foveacam_server.foundation.store import Store
from foveacam_server.resources.looking.clouds.collection import CloudCollection, FixationShape
from foveacam_server.resources.looking.clouds.depth_patches import DepthPatch


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    with Store(tmp_path) as found:
        yield found


def shape(*, faces: int = 1, n: int = 100, fixation_id: str = "fix-1") -> FixationShape:
    rng = np.random.default_rng(4)
    cloud = Cloud(
        points_rig_m=rng.normal(4.0, 0.1, (n, 3)).astype(np.float32),
        colors=rng.integers(0, 256, (n, 3), dtype=np.uint8),
        sigma_m=rng.uniform(0.001, 0.01, n).astype(np.float32),
    )
    mesh = DepthMesh(
        vertices_rig_m=np.eye(3, dtype=np.float32),
        faces=np.array([[0, 1, 2]] * faces, dtype=np.uint32).reshape(faces, 3),
        uv=np.zeros((3, 2), np.float32),
        texture=np.zeros((4, 4, 3), np.uint8),
    )
    patch = DepthPatch(
        fixation_id="fix-1",
        created_utc="2026-01-01T00:00:00Z",
        x0=10,
        y0=20,
        z_m=np.full((3, 3), 4.0, np.float32),
        sigma_m=np.full((3, 3), 0.01, np.float32),
    )
    picture = np.zeros((8, 8, 3), np.uint8)
    return FixationShape(
        fixation_id=fixation_id,
        cloud=cloud,
        mesh=mesh,
        depth_picture=picture,
        backend="sgbm",
        network_sha256=None,
        patch=patch,
        look_size=(720, 540),
        depth_size=(3, 3),
    )


def test_cloud_comes_back_as_it_was_put(store: Store) -> None:
    shelf, given = CloudCollection(store), shape()
    kept = shelf.points(shelf.put(given).id)
    np.testing.assert_array_equal(kept.points_rig_m, given.cloud.points_rig_m)
    np.testing.assert_array_equal(kept.colors, given.cloud.colors)
    np.testing.assert_array_equal(kept.sigma_m, given.cloud.sigma_m)


def test_document_tells_where_the_cloud_lies(store: Store) -> None:
    given = shape()
    document = CloudCollection(store).put(given)
    z_m = given.cloud.points_rig_m[:, 2]
    assert (document.z_min_m, document.z_max_m) == pytest.approx((z_m.min(), z_m.max()), abs=1e-5)
    assert document.points == 100


def test_cloud_without_a_surface_has_no_glb(store: Store) -> None:
    shelf = CloudCollection(store)
    document = shelf.put(shape(faces=0))
    assert document.glb_url is None
    with pytest.raises(NotFound, match=r"mesh\.glb"):
        shelf.file(document.id, "mesh.glb")


def test_new_shelf_knows_the_depth_of_the_old_one(store: Store) -> None:
    CloudCollection(store).put(shape())
    assert CloudCollection(store).patches.covering(11.0, 21.0)


def test_writing_that_was_cut_off_leaves_nothing_behind(store: Store) -> None:
    partial = store.subfolder("clouds") / "cld-00.part"
    partial.mkdir()
    (partial / "cloud.ply").write_bytes(b"ply")
    assert CloudCollection(store).newest(10) == []
    assert not partial.exists()


def test_removed_cloud_leaves_neither_files_nor_depth(store: Store) -> None:
    shelf = CloudCollection(store)
    cloud_id = shelf.put(shape()).id
    shelf.remove(cloud_id)
    assert not (store.folder / "clouds" / cloud_id).exists()
    assert not shelf.patches.covering(11.0, 21.0)
    with pytest.raises(NotFound):
        shelf.get(cloud_id)


def test_damaged_file_is_told(store: Store) -> None:
    shelf = CloudCollection(store)
    cloud_id = shelf.put(shape()).id
    shelf.file(cloud_id, "cloud.ply").write_bytes(b"nonsense")
    with pytest.raises(InvalidInput, match="damaged"):
        shelf.points(cloud_id)


def test_shape_that_a_full_disk_does_not_take_leaves_nothing_behind(
    store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(path: Path, content: bytes) -> int:
        raise OSError(errno.ENOSPC, "No space left on device", str(path))

    shelf = CloudCollection(store)
    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(StorageFull, match=r"the shape of fixation fix-1 in .*clouds: the disk is full"):
        shelf.put(shape())
    assert list((store.folder / "clouds").iterdir()) == []
    assert shelf.newest(10) == []
    assert not shelf.patches.covering(11.0, 21.0)
