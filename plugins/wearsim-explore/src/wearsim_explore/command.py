"""`wearsim explore`: a page on which the values of a scenario are changed."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, TypeAlias

import typer

ScenarioFile: TypeAlias = Annotated[
    Path, typer.Argument(metavar="SCENARIO", help="Scenario file (TOML).", show_default=False)
]
Port: TypeAlias = Annotated[
    int, typer.Option("--port", min=0, max=65535, help="Port; 0 for a free one.")
]
Host: TypeAlias = Annotated[
    str,
    typer.Option(
        "--host",
        metavar="ADDRESS",
        help="Address that the server opens; the default is reached from this machine only.",
    ),
]
Browser: TypeAlias = Annotated[
    bool, typer.Option("--browser/--no-browser", help="Open the page in the browser.")
]

app = typer.Typer(
    add_completion=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
)


@app.command()
def explore(
    scenario: ScenarioFile, port: Port = 0, host: Host = "127.0.0.1", browser: Browser = True
) -> None:
    """Change the values of a scenario on a page and see its results follow.

    The page is served until Ctrl-C. Files are read and written in the folder of the scenario only.
    """
    import ipaddress
    import signal

    from wearsim_explore.server import Exploration, design_of

    design = design_of(scenario)
    try:
        server = Exploration(design, host, port)
    except OSError as error:
        reason = error.strerror or error
        message = f"cannot serve at {host}:{port} ({reason}); choose another --port or --host"
        raise typer.BadParameter(message, param_hint="--port") from error
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # ends as by Ctrl-C
    try:
        typer.echo(server.address)
        try:
            local = ipaddress.ip_address(host).is_loopback
        except ValueError:
            local = host == "localhost"
        if not local:
            typer.echo(
                f"warning: port {server.port} of {host} is open to other machines: who has this"
                f" address can compute here, and read and save scenarios in"
                f" {design.file.resolve().parent}; nothing is encrypted",
                err=True,
            )
        typer.echo("Ctrl-C ends it", err=True)
        if browser:
            server.open()
        server.wait()
    except KeyboardInterrupt:
        typer.echo("ended", err=True)
    finally:
        server.close()
