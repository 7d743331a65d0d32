"""Process that reads requests from its standard input and writes answers to its standard output.

It ends when its standard input is closed, and then removes the folder that is its argument, so that
nothing is left of a server that was killed.
"""

from __future__ import annotations

import os
import pickle
import shutil
import signal
import struct
import sys
import threading
from queue import Queue
from typing import IO, Any

LENGTH = struct.Struct(">Q")  # of the pickled message that follows


def read_message(stream: IO[bytes]) -> Any:
    """Return the next message of a stream; EOFError at its end."""
    head = stream.read(LENGTH.size)
    if len(head) < LENGTH.size:
        raise EOFError
    return pickle.loads(stream.read(*LENGTH.unpack(head)))


def message_of(content: Any) -> bytes:
    """Return a message as it is sent."""
    data = pickle.dumps(content, pickle.HIGHEST_PROTOCOL)
    return LENGTH.pack(len(data)) + data


def main() -> None:
    """Compute answers until the standard input is closed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the server, which closes the input
    output = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # text printed by libraries must not mix with answers
    if "--slow" in sys.argv:
        os.nice(10)
    requests: Queue[Any] = Queue()
    stop = threading.Event()

    def read() -> None:
        while True:
            try:
                message = read_message(sys.stdin.buffer)
            except (EOFError, OSError):
                shutil.rmtree(sys.argv[1], ignore_errors=True)
                os._exit(0)
            if message is None:
                stop.set()
            else:
                stop.clear()  # a worker has one request at a time
                requests.put(message)

    threading.Thread(target=read, daemon=True).start()
    from wearsim import Interrupted  # noqa: PLC0415  (while requests are read)
    from wearsim_explore.answers import answer  # noqa: PLC0415

    def send(content: Any) -> None:
        output.write(message_of(content))
        output.flush()

    while True:
        request = requests.get()
        try:
            send(answer(request, stop.is_set, send))
        except Interrupted:
            send(None)
        except Exception as error:  # a defect ends this answer only
            send(RuntimeError(f"{type(error).__name__}: {error}"))


if __name__ == "__main__":
    main()
