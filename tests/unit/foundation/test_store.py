from pathlib import Path

import pytest
from sqlalchemy import text

from foveacam_hardware.contract import Busy, InvalidInput
from foveacam_server.foundation.store import Store


def test_second_server_on_the_same_folder_is_refused(tmp_path: Path) -> None:
    with Store(tmp_path), pytest.raises(Busy, match="in use by another FoveaCam server"):
        Store(tmp_path)


def test_folder_is_free_again_after_closing(tmp_path: Path) -> None:
    Store(tmp_path).close()
    Store(tmp_path).close()


def test_folder_that_cannot_be_made_is_named_with_a_remedy(tmp_path: Path) -> None:
    in_the_way = tmp_path / "file"
    in_the_way.write_text("")
    with pytest.raises(InvalidInput, match=r"file.*--data"):
        Store(in_the_way / "data")


def test_database_keeps_a_write_ahead_log(tmp_path: Path) -> None:
    with Store(tmp_path) as store, store.session() as session:
        assert session.execute(text("PRAGMA journal_mode")).scalar_one() == "wal"
