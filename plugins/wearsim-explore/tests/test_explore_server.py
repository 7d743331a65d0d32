"""The server: token, origins, files, and its end."""

from __future__ import annotations

import ast
import json
import os
import re
import signal
import socket
import subprocess
import tempfile
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from concurrent.futures import Future
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

import wearsim
from tests.interruptible import interruptible
from wearsim.cli.app import app
from wearsim_explore.server import Exploration, design_of

RIG = (Path(__file__).parent / "rig.toml").read_text()
SOURCES = Path(__file__).parents[1] / "src" / "wearsim_explore"


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Exploration]:
    """Return a server on a test of the short rig."""
    path = tmp_path_factory.mktemp("served") / "rig.toml"
    path.write_text(RIG)
    opened = Exploration(design_of(path), workers=1)
    yield opened
    opened.close()


def fetched(address: str) -> tuple[int, str]:
    try:
        with urllib.request.urlopen(address) as answer:
            return answer.status, answer.read().decode()
    except urllib.error.HTTPError as error:
        return error.code, error.read().decode()


def test_page_needs_the_token(server: Exploration) -> None:
    base, _, token = server.address.partition("?token=")
    for wrong in (base, f"{base}?token=", f"{base}?token={token[:-1]}", f"{base}?token={token}x"):
        status, text = fetched(wrong)
        assert status == 403
        assert "The address needs its token" in text
        assert token not in text
    assert not server.pages
    for path in ("metadata", "autoload.js?bokeh-autoload-element=x"):
        assert fetched(base + path)[0] == 403


def test_server_is_reached_from_this_machine_only(server: Exploration) -> None:
    assert server.host == "127.0.0.1"
    assert server.address.startswith(f"http://127.0.0.1:{server.port}/?token=")


@pytest.fixture(scope="module")
def session_token(server: Exploration) -> str:
    """Return the token of a session, which the page holds."""
    status, text = fetched(server.address)
    assert status == 200
    return re.search(r'"token":"([^"]+)"', text)[1]  # type: ignore[index]


@pytest.mark.parametrize(
    ("origin", "signed", "opens"),
    [
        ("http://127.0.0.1:{port}", True, True),
        ("http://evil.example", True, False),
        ("http://localhost:1", True, False),
        ("http://127.0.0.1:{port}", False, False),
    ],
)
def test_other_origins_are_refused(
    server: Exploration, session_token: str, origin: str, signed: bool, opens: bool
) -> None:
    token = session_token if signed else session_token[:-4] + "AAAA"

    lines = [
        "GET /ws HTTP/1.1",
        f"Host: 127.0.0.1:{server.port}",
        "Upgrade: websocket",
        "Connection: Upgrade",
        "Sec-WebSocket-Version: 13",
        "Sec-WebSocket-Key: d2VhcnNpbSBleHBsb3JlIQ==",
        f"Sec-WebSocket-Protocol: bokeh, {token}",
        f"Origin: {origin.format(port=server.port)}",
    ]
    with socket.create_connection(("127.0.0.1", server.port), timeout=20) as connection:
        connection.sendall(("\r\n".join(lines) + "\r\n\r\n").encode())
        stream = connection.makefile("rb")
        head = stream.readline()
        while stream.readline().strip():
            pass
        first = stream.read(1) if b" 101 " in head else b""
        stream.close()
    # the first frame of an open connection is a text, not its end
    assert (first == b"\x81") is opens
    assert (b" 403 " in head) is (signed and not opens)


def opened(server: Exploration) -> Any:
    """Return a page that has just been opened."""
    assert fetched(server.address)[0] == 200
    return server.pages[-1]


def done(page: Any, action: str, **values: Any) -> dict[str, Any]:
    """Do something on a page, as the browser asks for it; return what it then shows."""
    shown: Future[str] = Future()

    def act() -> None:
        page._on_request("request", "", json.dumps({"do": action, **values}))
        shown.set_result(page._exchange.reply)

    page.document.add_next_tick_callback(act)
    content: dict[str, Any] = json.loads(shown.result(20))
    return content


def test_scenario_is_saved_beside_its_file_only(server: Exploration) -> None:
    page, folder = opened(server), server.design.file.parent
    done(page, "change", key="roller.radius", value="21", begins=True)
    saved = done(page, "save", name="wider.toml")
    assert saved["message"] == f"saved: {folder / 'wider.toml'}"
    text = (folder / "wider.toml").read_text()
    assert 'radius = "21 mm"          # of the rig' in text
    before = sorted(folder.rglob("*")), sorted(folder.parent.iterdir())
    for name in ("../a.toml", "/tmp/a.toml", "a/b.toml", "a.txt", "", ".toml", "..\\a.toml"):
        assert done(page, "save", name=name)["message"].startswith("refused: "), name
    (folder / "link.toml").symlink_to(folder.parent / "elsewhere.toml")
    assert done(page, "save", name="link.toml")["message"].startswith("refused: ")
    (folder / "link.toml").unlink()
    assert (sorted(folder.rglob("*")), sorted(folder.parent.iterdir())) == before
    # nothing is overwritten without being asked
    done(page, "change", key="roller.radius", value="22", begins=True)
    again = done(page, "save", name="wider.toml")
    assert again["exists"]
    assert (folder / "wider.toml").read_text() == text
    done(page, "save", name="wider.toml", force=True)
    assert 'radius = "22 mm"' in (folder / "wider.toml").read_text()


def test_error_of_a_session_does_not_end_another(server: Exploration) -> None:
    page = opened(server)
    for wrong in ({"key": "no.such", "value": "1", "begins": True}, {}):
        assert done(page, "change", **wrong)["message"].startswith("refused: KeyError")
    assert "is no action" in done(page, "explode")["message"]
    assert "no changes" in done(page, "restore", changes=["a"])["message"]
    assert opened(server) is not page


def test_scenario_that_names_files_elsewhere_is_refused(rig: Path) -> None:
    (rig.parents[1] / "worn.csv").write_text("y [mm],height [um]\n-9,0\n0,-1\n9,0\n")
    text = rig.read_text().replace("[cylinder]", '[cylinder]\nprofile = "../worn.csv"')
    rig.write_text(text)
    assert wearsim.load_scenario(rig).cylinder.profile is not None
    done = CliRunner().invoke(app, ["explore", str(rig), "--no-browser"])
    assert done.exit_code == 2
    assert "outside the folder of the scenario" in done.output


def test_mistakes_and_taken_ports_are_one_error(rig: Path, server: Exploration) -> None:
    taken = CliRunner().invoke(app, ["explore", str(rig), "--port", str(server.port)])
    assert taken.exit_code == 2
    assert "--port" in taken.output
    rig.write_text(rig.read_text().replace("0.1", "-0.1"))
    wrong = CliRunner().invoke(app, ["explore", str(rig), "--no-browser"])
    assert wrong.exit_code == 2
    assert "[friction] coefficient: is out of range" in wrong.output


def test_plugin_imports_public_modules_only() -> None:
    public = {"wearsim", "wearsim.plugins", "wearsim.report", "wearsim.types"}
    for path in SOURCES.glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            names = [node.module] if isinstance(node, ast.ImportFrom) else []
            names += [one.name for one in node.names] if isinstance(node, ast.Import) else []
            inner = [name for name in names if name and name.startswith("wearsim.")]
            assert set(inner) <= public, path.name


def children(of: int) -> list[int]:
    """Return the processes that a process has started."""
    listed = Path(f"/proc/{of}/task/{of}/children")
    tasks = Path(f"/proc/{of}/task")
    found = [
        int(pid) for task in tasks.iterdir() for pid in (task / "children").read_text().split()
    ]
    assert listed.exists()
    return found


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="needs the processes of Linux")
@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGKILL])
def test_nothing_is_left_behind(rig: Path, how: signal.Signals, tmp_path: Path) -> None:
    scratch = tmp_path / "scratch"
    scratch.mkdir()
    command = interruptible("-m", "wearsim", "explore", rig, "--no-browser")
    process = subprocess.Popen(
        command,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        env={**os.environ, "TMPDIR": str(scratch)},
    )
    assert process.stdout is not None
    address = process.stdout.readline().strip()
    assert fetched(address)[0] == 200
    started = []
    for _ in range(200):
        if started := children(process.pid):
            break
        time.sleep(0.05)
    assert started
    process.send_signal(how)
    code = process.wait(60)
    process.stdout.close()
    assert code == (-signal.SIGKILL if how == signal.SIGKILL else 0)
    for _ in range(200):
        left = [pid for pid in started if Path(f"/proc/{pid}").exists() and not _is_zombie(pid)]
        if not left:
            break
        time.sleep(0.05)
    assert not left
    assert not list(scratch.iterdir())
    assert sorted(path.name for path in rig.parent.iterdir()) == ["rig.toml", "scratch"]
    assert tempfile.gettempdir() != str(scratch)


def _is_zombie(pid: int) -> bool:
    try:
        return ") Z " in Path(f"/proc/{pid}/stat").read_text()
    except OSError:
        return True


def test_notebook_shows_the_page(rig: Path) -> None:
    page = wearsim.explore(rig)
    try:
        shown = page._repr_html_()
        assert page.address.replace("&", "&amp;") in shown
        assert shown.startswith("<iframe")
    finally:
        page.close()
    with pytest.raises(urllib.error.URLError):
        urllib.request.urlopen(page.address)
