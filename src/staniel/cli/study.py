"""The command line of studies: `staniel study list | run | show | report`."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import typer

from staniel.cli.interrupt import INTERRUPTED, stop_between_events

__all__ = ["study_app"]

FAILED = 1
"""Exit code of a study of which some runs failed."""

study_app = typer.Typer(no_args_is_help=True, rich_markup_mode=None)

StudyArgument = Annotated[
    str, typer.Argument(metavar="STUDY", help="A packaged study, its number, or a TOML file.")
]
Folder = Annotated[Path, typer.Argument(metavar="DIR", help="Folder of a study that was run.")]


@study_app.command("list")
def list_studies() -> None:
    """List the packaged studies."""
    from staniel.studies import load_study, study_names

    names = study_names()
    width = max(map(len, names))
    for name in names:
        study = load_study(name)
        points = len(study.combinations())
        typer.echo(f"{name:<{width}}  {points:3d} points  {study.question}")


@study_app.command("run")
def run(
    study: StudyArgument,
    seeds: Annotated[
        int | None, typer.Option(min=1, metavar="N", help="Seeds at each point.")
    ] = None,
    minutes: Annotated[
        float | None, typer.Option(metavar="M", help="Mission time of each run.")
    ] = None,
    workers: Annotated[
        int | None, typer.Option(min=1, metavar="K", help="Processes; not set: one a core.")
    ] = None,
    scheduler: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="Dask scheduler that flies the runs.")
    ] = None,
    modules: Annotated[
        list[str] | None,
        typer.Option("--import", metavar="MODULE", help="Python module each worker imports first."),
    ] = None,
    retry: Annotated[bool, typer.Option("--retry", help="Fly failed runs again.")] = False,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="DIR", help="Folder; not set: studies/NAME.")
    ] = None,
    quiet: Annotated[bool, typer.Option("--quiet", help="No progress, no tables.")] = False,
) -> None:
    """Fly what is missing of a study; the same command goes on where it was stopped."""
    with stop_between_events() as stop_if_asked:
        from staniel import studies
        from staniel.terminal import StudyReporter

        chosen = studies.load_study(study)
        folder = Path("studies", chosen.name) if out is None else out
        reporter = StudyReporter(chosen.name, quiet=quiet)
        listen = _both(stop_if_asked, reporter.on_event)
        try:
            with reporter:
                studies.run(
                    chosen,
                    folder,
                    seeds=seeds,
                    minutes=minutes,
                    workers=workers,
                    scheduler=scheduler,
                    modules=tuple(modules or ()),
                    retry=retry,
                    on_event=listen,
                )
        except KeyboardInterrupt:
            reporter.stopped(folder)
            raise typer.Exit(INTERRUPTED) from None
    results = studies.read_results(folder)
    if not quiet:
        from staniel.studies.tables import summary

        reporter.summarise(summary(results), folder)
    if results.failures:
        raise typer.Exit(FAILED)


@study_app.command("show")
def show(
    folder: Folder,
    json_output: Annotated[
        bool, typer.Option("--json", help="Everything as JSON on standard output.")
    ] = False,
) -> None:
    """Print the means of a study with their intervals, and what they say of its claims."""
    from staniel.studies import read_results
    from staniel.studies.tables import summary

    about = summary(read_results(folder))
    if json_output:
        typer.echo(json.dumps(about, indent=1, allow_nan=False, ensure_ascii=False))
        return
    from rich.console import Console

    from staniel.terminal import print_summary

    print_summary(about, Console(highlight=False))


@study_app.command("report")
def report(folder: Folder) -> None:
    """Write the report of a study, as one HTML page, and its figures."""
    from staniel.studies import read_results
    from staniel.studies.report import write_report

    for file in write_report(read_results(folder)):
        typer.echo(str(file))


def _both(first: Callable[[], None], then: Callable[..., None]) -> Callable[..., None]:
    def listen(event: str, **info: Any) -> None:  # noqa: ANN401 - as the event has it
        first()
        then(event, **info)

    return listen
