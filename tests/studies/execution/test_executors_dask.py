"""Tests of the Dask executor with starting, stopping and killed workers."""

from __future__ import annotations

import itertools
import re
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import dask
import distributed  # noqa: F401  (gives dask.config its defaults)
import pytest
from batch_works import Deadly, Raising, Squares
from dask_cluster import scheduler, worker

from tests.interruptible import interruptible
from wearsim.errors import Mistake, ScenarioError, WorkerError
from wearsim.studies.execution import dask as executors_cluster, dask as executors_dask
from wearsim.studies.execution.factory import executor
from wearsim.studies.execution.processes import AHEAD

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module", autouse=True)
def frequent_checks() -> Iterator[None]:
    """Shorten the interval between looks at the workers of a cluster."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(executors_cluster, "LOOKING", 0.1)
        yield


@pytest.fixture(scope="module")
def address(frequent_checks: None, tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """A scheduler with two workers."""
    folder = tmp_path_factory.mktemp("cluster")
    with ExitStack() as stack:
        where, _ = stack.enter_context(scheduler(folder))
        for _ in range(2):
            stack.enter_context(worker(where, folder))
        with executor(where) as cluster:
            _wait_for(cluster, 2)
        yield where


def _wait_for(cluster: executors_cluster.Cluster, workers: int) -> None:
    while cluster.workers != workers:
        time.sleep(0.1)


def test_cluster_runs_every_batch_once(address: str) -> None:
    batches = [list(range(first, first + 3)) for first in range(0, 90, 3)]
    with executor(address) as cluster:
        assert cluster.describe == f"dask {address}, 2 workers"
        found = list(cluster.results(Squares(0.01), iter(batches)))
    assert sorted(numbers for numbers, _ in found) == batches
    for numbers, results in found:
        assert [square for square, _ in results] == [number * number for number in numbers]
    assert len({pid for _, results in found for _, pid in results}) == 2


def test_number_of_batches_in_progress_is_limited(address: str) -> None:
    taken: list[int] = []
    with executor(address) as cluster:
        endless = (taken.append(number) or [number] for number in itertools.count())
        found = cluster.results(Squares(), endless)
        for received in range(1, 20):
            next(found)
            assert len(taken) - received <= AHEAD * 2
        found.close()


def test_error_of_the_work_is_raised_unchanged(address: str) -> None:
    mistakes = [Mistake("load", "normal_force", "must be above zero")]
    with executor(address) as cluster, pytest.raises(ScenarioError) as caught:
        list(cluster.results(Raising(ScenarioError, "rig.toml", mistakes), iter([[1]])))
    assert caught.value.mistakes == mistakes


def test_batches_of_a_killed_worker_are_repeated(tmp_path: Path) -> None:
    messages: list[str] = []
    with (
        scheduler(tmp_path) as (where, _),
        worker(where, tmp_path),
        worker(where, tmp_path),
        executor(where, on_notice=messages.append) as cluster,
    ):
        _wait_for(cluster, 2)
        work = Deadly(tmp_path, at=13, times=1)
        found = dict(cluster.results(work, iter([(number,) for number in range(40)])))
        _wait_for(cluster, 1)
    (message,) = [item for item in messages if not item.startswith("waiting")]
    assert re.fullmatch(
        r"lost worker tcp://127\.0\.0\.1:\d+, and 1 is left; unfinished batches are done again",
        message,
    )
    assert (tmp_path / "killed 0").exists()
    assert found == {(number,): [number * number] for number in range(40)}


def test_study_continues_with_new_workers(tmp_path: Path) -> None:
    messages: list[str] = []
    with scheduler(tmp_path) as (where, _), ExitStack() as stack:

        def join(message: str) -> None:
            messages.append(message)
            stack.enter_context(worker(where, tmp_path))

        # the only worker ends with the only copy of the work, and another one joins
        with executor(where, on_notice=join) as cluster:
            work = Deadly(tmp_path, at=5, times=1)
            found = dict(cluster.results(work, iter([(number,) for number in range(12)])))
    assert found == {(number,): [number * number] for number in range(12)}
    assert messages == [f"waiting for workers: there are none at {where}"] * 2


def test_cluster_without_workers_raises_after_a_time_limit(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(executors_cluster, "PATIENCE", 0.3)
    with scheduler(tmp_path) as (where, _):
        expected = f"the scheduler at {where} has had no workers for 0.3 s; start some with: dask"
        with pytest.raises(WorkerError, match=re.escape(expected)), executor(where):
            pass


def test_first_interrupt_ends_a_study_without_workers(tmp_path: Path) -> None:
    scenario = Path(__file__).parents[3] / "scenarios" / "rig-ensemble.toml"
    with scheduler(tmp_path) as (where, _):
        arguments = ["ensemble", scenario, "-n", "4", "-o", "a.h5", "--scheduler", where]
        with subprocess.Popen(
            interruptible("-m", "wearsim", *arguments),
            cwd=tmp_path,
            stderr=subprocess.PIPE,
            text=True,
        ) as running:
            assert running.stderr is not None
            while "waiting for workers" not in running.stderr.readline():
                pass
            running.send_signal(signal.SIGINT)
            message = running.communicate(timeout=60)[1]
    assert running.returncode == 130
    assert f"stopped: there are no workers at {where}" in message
    assert not (tmp_path / "a.h5").exists()


def test_stop_ends_a_study_whose_workers_were_lost(tmp_path: Path) -> None:
    stop = threading.Event()
    with (
        scheduler(tmp_path) as (where, _),
        worker(where, tmp_path) as process,
        executor(where, on_notice=print, stop_requested=stop.is_set) as cluster,
    ):
        found = cluster.results(Squares(0.01), ([number] for number in itertools.count()))
        next(found)
        process.kill()
        stop.set()
        with pytest.raises(KeyboardInterrupt):
            list(found)


def test_killed_scheduler_is_reported(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], caplog: pytest.LogCaptureFixture
) -> None:
    with (
        dask.config.set({"distributed.comm.timeouts.connect": "3s"}),
        scheduler(tmp_path) as (where, process),
        worker(where, tmp_path),
        executor(where) as cluster,
    ):
        found = cluster.results(Squares(0.01), ([number] for number in itertools.count()))
        next(found)
        process.kill()
        with pytest.raises(WorkerError, match=f"the scheduler at {where} is gone"):
            list(found)
    assert "Traceback" not in capfd.readouterr().err
    assert "Traceback" not in caplog.text


def test_other_version_on_a_worker_is_reported(tmp_path: Path) -> None:
    other = tmp_path / "site" / "wearsim-99.9.dist-info"
    other.mkdir(parents=True)
    (other / "METADATA").write_text("Metadata-Version: 2.1\nName: wearsim\nVersion: 99.9\n")
    with (
        scheduler(tmp_path) as (where, _),
        worker(where, tmp_path, str(other.parent)),
        pytest.raises(WorkerError, match=r"is here, and 99\.9 on the worker tcp://127"),
        executor(where),
    ):
        pass


def test_other_version_on_a_late_worker_is_reported(
    address: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    with executor(address) as cluster:
        monkeypatch.setattr(executors_cluster, "version", lambda name: "99.9")
        with pytest.raises(WorkerError, match=r"wearsim 99\.9 is here, and "):
            list(cluster.results(Squares(), iter([[1]])))


@contextmanager
def _mute_server() -> Iterator[str]:
    """Provide the address of a server that is no scheduler and sends nothing."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        held = []
        threading.Thread(target=lambda: held.append(server.accept()[0]), daemon=True).start()
        yield f"tcp://127.0.0.1:{server.getsockname()[1]}"
        for connection in held:
            connection.close()


def test_address_without_scheduler_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(executors_dask, "CONNECTING", 0.5)
    with socket.create_server(("127.0.0.1", 0)) as server:
        free = f"tcp://127.0.0.1:{server.getsockname()[1]}"
    with _mute_server() as mute:
        for unused in (free, mute, "tcp://no-such-host.invalid:8786"):
            with pytest.raises(WorkerError) as caught, executor(unused):
                pass
            assert str(caught.value).startswith(f"no Dask scheduler answers at {unused} within")
            assert "\n" not in str(caught.value)


def test_missing_dask_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    monkeypatch.delitem(sys.modules, "wearsim.studies.execution.dask")
    expected = r'pip install "wearsim\[cluster\]"'
    for chosen in ("dask", "tcp://127.0.0.1:8786"):
        with pytest.raises(WorkerError, match=expected), executor(chosen):
            pass


def test_local_cluster_runs_batches_and_reports_killers(
    tmp_path: Path,
) -> None:
    with (
        dask.config.set({"distributed.scheduler.allowed-failures": 0}),
        executor("dask", 2) as cluster,
    ):
        assert cluster.workers == 2
        found = dict(cluster.results(Squares(), iter([(number,) for number in range(20)])))
        with pytest.raises(WorkerError, match="died of realisation 3 again") as caught:
            list(cluster.results(Deadly(tmp_path, at=3, times=9), iter([(3,)])))
    assert {n: rows[0][0] for (n,), rows in found.items()} == {n: n * n for n in range(20)}
    assert caught.value.realisations == (3,)
