"""The command line: `staniel fly | replay | export | scenario | study`.

Whatever is heavy is imported inside the command that needs it: `staniel --help` is there at once.
Standard output carries what was asked for (`--json`, a scenario's text) and nothing else; progress,
tables and errors go to standard error.
"""

import json
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer
from typer.core import TyperGroup

from staniel._version import __version__
from staniel.cli.interrupt import INTERRUPTED, stop_between_events
from staniel.cli.study import study_app
from staniel.errors import StanielError

if TYPE_CHECKING:
    from staniel.scenario import Scenario

__all__ = ["app", "main"]


class _Group(TyperGroup):
    """Our own errors end with their message and exit code 2; a bug keeps its traceback."""

    def invoke(self, ctx: Any) -> Any:  # noqa: ANN401 - click's own, wherever typer keeps it
        try:
            return super().invoke(ctx)
        except StanielError as error:
            typer.echo(f"error: {error}", err=True)
            raise typer.Exit(2) from None
        except KeyboardInterrupt:
            typer.echo("stopped by hand", err=True)
            raise typer.Exit(INTERRUPTED) from None


app = typer.Typer(
    cls=_Group,
    help="Teams of small aircraft that keep moving ground vehicles in sight in a dense city.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)
scenario_app = typer.Typer(no_args_is_help=True, rich_markup_mode=None)
app.add_typer(scenario_app, name="scenario", help="Show, list and check scenarios.")
app.add_typer(study_app, name="study", help="Many runs over factors and seeds, with intervals.")

ScenarioArgument = Annotated[
    str, typer.Argument(metavar="SCENARIO", help="A TOML file or a packaged scenario.")
]
Settings = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="Change a key, e.g. aircraft.count=2. Repeat."),
]
# Numbers are read as text and checked with the scenario: its messages name value and expectation.
Seed = Annotated[str | None, typer.Option(metavar="N", help="Seed of the run.")]
CityFile = Annotated[
    str | None, typer.Option("--city", metavar="FILE", help="Map: image, Moving AI .map, .geojson.")
]
Cell = Annotated[
    str | None, typer.Option(metavar="METRES", help="Metres per pixel or grid cell of the map.")
]
Minutes = Annotated[str | None, typer.Option(metavar="MINUTES", help="Mission time.")]
Movie = Annotated[bool, typer.Option("--movie", help="Draw mission.gif, too.")]
Out = Annotated[Path | None, typer.Option("--out", metavar="DIR", help="Folder for the results.")]
RunFolder = Annotated[Path, typer.Argument(metavar="RUN", help="Folder of a recorded run.")]


def main() -> None:
    """Entry point of the `staniel` command."""
    warnings.formatwarning = _warning_line
    app()


def _warning_line(
    message: Warning | str,
    category: type[Warning],
    filename: str,
    lineno: int,
    line: str | None = None,
) -> str:
    """Our own warnings are for people; the others keep the place that they come from."""
    if category.__module__.startswith("staniel."):
        return f"warning: {message}\n"
    return f"{filename}:{lineno}: {category.__name__}: {message}\n"


def _print_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"staniel {__version__}")
        raise typer.Exit


@app.callback()
def _root(
    version: Annotated[
        bool,
        typer.Option("--version", callback=_print_version, is_eager=True, help="Print and leave."),
    ] = False,
) -> None:
    """Take the options that belong to no command."""


@app.command()
def fly(
    scenario: ScenarioArgument = "downtown",
    seed: Seed = None,
    settings: Settings = None,
    city: CityFile = None,
    cell: Cell = None,
    minutes: Minutes = None,
    movie: Movie = False,
    out: Out = None,
    json_output: Annotated[
        bool, typer.Option("--json", help="Print the metrics as JSON on standard output.")
    ] = False,
    quiet: Annotated[bool, typer.Option("--quiet", help="No progress, no tables.")] = False,
) -> None:
    """Fly a scenario and record it in a folder of its own."""
    with stop_between_events() as stop_if_asked:
        chosen = _load(scenario, seed, settings, city, cell, minutes)
        folder = _new_folder(chosen) if out is None else out

        from staniel import flight
        from staniel.terminal import Reporter

        reporter = Reporter(quiet=quiet)

        def on_event(event: str, **info: Any) -> None:  # noqa: ANN401 - as the event has it
            stop_if_asked()
            reporter.on_event(event, **info)

        with reporter:
            run = flight.fly(chosen, out=folder, movie=movie, on_event=on_event)
    if not quiet:
        reporter.summarise(run)
    if json_output:
        typer.echo(json.dumps(run.metrics, indent=1, allow_nan=False))
    if run.interrupted:
        raise typer.Exit(INTERRUPTED)


@app.command()
def replay(run: RunFolder, movie: Movie = False, out: Out = None) -> None:
    """Draw a recorded run and compute its metrics again, from the record alone."""
    from staniel import flight
    from staniel.terminal import Reporter

    with Reporter() as reporter:
        result = flight.replay(run, out=out, movie=movie, on_event=reporter.on_event)
    reporter.summarise(result)


@app.command()
def export(
    run: RunFolder,
    csv: Annotated[bool, typer.Option("--csv", help="Comma-separated text.")] = False,
    parquet: Annotated[bool, typer.Option("--parquet", help="Parquet files.")] = False,
    out: Out = None,
) -> None:
    """Write a recorded run as tables."""
    if csv == parquet:
        raise typer.BadParameter("expected exactly one of --csv and --parquet")
    kind: Literal["csv", "parquet"] = "csv" if csv else "parquet"

    from staniel.recording import export as write_tables
    from staniel.recording import read_record

    folder = (run if run.is_dir() else run.parent) / kind if out is None else out
    for file in write_tables(read_record(run), folder, kind):
        typer.echo(str(file))


@scenario_app.command("show")
def show(
    scenario: ScenarioArgument = "downtown",
    seed: Seed = None,
    settings: Settings = None,
    city: CityFile = None,
    cell: Cell = None,
    minutes: Minutes = None,
) -> None:
    """Print a scenario with every key, after all changes."""
    from staniel.scenario import dump_scenario

    chosen = _load(scenario, seed, settings, city, cell, minutes)
    typer.echo(dump_scenario(chosen, __version__), nl=False)


@scenario_app.command("list")
def list_scenarios() -> None:
    """List the packaged scenarios."""
    from staniel.scenario import load_scenario, preset_names

    names = preset_names()
    width = max(map(len, names))
    for name in names:
        typer.echo(f"{name:<{width}}  {load_scenario(name).description}")


@scenario_app.command("check")
def check(
    scenario: ScenarioArgument = "downtown",
    seed: Seed = None,
    settings: Settings = None,
    city: CityFile = None,
    cell: Cell = None,
    minutes: Minutes = None,
) -> None:
    """Check a scenario, build its city and place everything in it, without flying."""
    from staniel.scenario import build_city
    from staniel.scenario.assemble import assemble

    chosen = _load(scenario, seed, settings, city, cell, minutes)
    assemble(chosen, build_city(chosen.city, chosen.seed))
    typer.echo(f"{scenario}: good")


def _load(
    scenario: str,
    seed: str | None,
    settings: list[str] | None,
    city: str | None,
    cell: str | None,
    minutes: str | None,
) -> "Scenario":
    """Read the scenario and lay the options over it; a named option wins over --set."""
    from staniel.scenario import load_scenario, read_settings

    changes: list[str | tuple[str, Any]] = list(settings or [])
    if city is not None:
        # Images are recognised by their content, all else only by its name.
        source = {".map": "grid", ".geojson": "geojson", ".json": "geojson"}.get(
            Path(city).suffix.lower(), "image"
        )
        changes.append(("city", {"source": source, "file": city}))
    named = {"seed": seed, "minutes": minutes, "city.cell": cell}
    changes += [(key, _number(text)) for key, text in named.items() if text is not None]
    return load_scenario(scenario, **read_settings(changes))


def _number(text: str) -> int | float | str:
    """The number that a text says, or the text itself for the scenario to refuse."""
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    return text


def _new_folder(scenario: "Scenario") -> Path:
    """A folder under runs/ that does not exist yet."""
    name = f"{scenario.name}-{scenario.seed}"
    folder, number = Path("runs", name), 1
    while folder.exists() or folder.is_symlink():
        number += 1
        folder = Path("runs", f"{name}-{number}")
    return folder
