"""Calls that Linux alone has are done without where the system has none of them, as on macOS."""

import ctypes
import os
import resource
from pathlib import Path

import pytest

from foveacam_hardware.wire.guardian import watch_process
from foveacam_server.checks.machine import Machine
from foveacam_server.doors import process_limits, server
from foveacam_server.resources.operating.engine.process_files import ProcessFiles


def test_the_guardian_does_without_a_pidfd(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delattr(os, "pidfd_open")
    assert watch_process(os.getpid()) is None


def test_crops_are_made_on_all_cores_where_affinity_is_unknown(monkeypatch: pytest.MonkeyPatch) -> None:
    torch = pytest.importorskip("torch", reason="the extra `learn` is not installed")
    from foveacam_pipeline.learn.loading import default_workers

    monkeypatch.delattr(os, "sched_getaffinity")
    monkeypatch.setattr(os, "cpu_count", lambda: 3)
    assert default_workers(torch.device("cuda")) == 2


def test_the_limit_of_open_files_stays_where_the_system_refuses(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(_kind: int, _limits: tuple[int, int]) -> None:
        raise ValueError("current limit exceeds maximum limit")

    monkeypatch.setattr(resource, "getrlimit", lambda _kind: (256, resource.RLIM_INFINITY))
    monkeypatch.setattr(resource, "setrlimit", refuse)
    assert server.allow_open_files() == 256


def test_the_allocator_is_left_alone_without_glibc(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[str] = []

    def missing(name: str) -> object:
        asked.append(name)
        raise OSError(f"{name}: not found")

    monkeypatch.setattr(ctypes, "CDLL", missing)
    process_limits.bound_arenas()
    assert asked == ["libc.so.6"]


def test_a_process_without_proc_has_no_figures(tmp_path: Path) -> None:
    files = ProcessFiles(Machine(root=tmp_path))
    assert (files.cpu_s(), files.age_s(), files.memory_mb(), files.open_files()) == ({}, None, None, None)
