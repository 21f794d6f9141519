"""``logpose run``."""

from typing import Any

import click

from .main import COMMANDS
from .options import run_options


@click.command(
    "run",
    help=COMMANDS["run"],
    epilog="""
    \b
    logpose run pipeline.yaml drive.mcap -o out/
    logpose run out/run.yaml drive.mcap -o again/
    logpose run --schema > pipeline.schema.json
    """,
)
@click.option("--schema", is_flag=True, help="Print the JSON schema of pipeline files, and stop.")
@click.argument("pipeline", required=False, metavar="PIPELINE")
@run_options
def command(schema: bool, pipeline: str | None, **options: Any) -> int:
    """Print the schema, or run the file (or bundled pipeline) that is named."""
    if schema:
        import json

        from ..pipelines.catalog import STAGES
        from ..pipelines.engine.schema import pipeline_schema

        click.echo(json.dumps(pipeline_schema(STAGES), indent=1))
        return 0
    if pipeline is None:
        raise click.UsageError(
            "no pipeline file. Name one, or a bundled pipeline like localize-pf.", click.get_current_context()
        )
    from .call import Call, execute

    return execute(Call(name=pipeline, options=options))
