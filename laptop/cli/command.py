"""Base class of the commands: former options, exclusive options, help in sections."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Any

import click
from click.core import ParameterSource

from laptop.cli.commands import command_name
from laptop.cli.old_options import renamed_args
from laptop.cli.rules import check_rules


class OwnCommand(click.Command):
    """A command that also accepts former options, and checks RULES.

    Args:
        sections: title -> names of options, in which its help shows these; None: in one list.
        common: names of options that --help shows; the others are shown by --help-all.  None: it
            shows all.
    """

    def __init__(
        self,
        *args: Any,
        sections: Mapping[str, Sequence[str]] | None = None,
        common: Collection[str] = (),
        **more: Any,
    ) -> None:
        super().__init__(*args, **more)
        self._sections = dict(sections or {})
        self._common = set(common)
        self._all_shown = False
        if self._common:
            self.params.append(
                click.Option(
                    ["--help-all"],
                    is_flag=True,
                    is_eager=True,
                    expose_value=False,
                    callback=self._show_all,
                    help="Show all options and exit.",
                )
            )

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Parse arguments, with former options replaced; refuse options that exclude each other."""
        command = command_name(ctx)
        try:
            rest = super().parse_args(ctx, list(renamed_args(command, args)))
            if not ctx.resilient_parsing:
                check_rules(command, set(typed_options(ctx)))
        except click.UsageError as error:
            error.ctx = error.ctx or ctx  # whose help to see
            raise
        return rest

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the options, section by section where there are sections."""
        if not self._sections:
            super().format_options(ctx, formatter)
            return
        rows = {
            name_of(param): param.get_help_record(ctx)
            for param in self.get_params(ctx)
            if isinstance(param, click.Option)
        }
        named = {name for names in self._sections.values() for name in names}
        rest = [name for name in rows if name not in named]
        for title, names in {**self._sections, "Help": rest}.items():
            shown = [
                row
                for name in names
                if self._all_shown or name in self._common or not self._common or title == "Help"
                if (row := rows[name])
            ]
            if shown:
                with formatter.section(title):
                    formatter.write_dl(shown)

    def _show_all(self, ctx: click.Context, _: click.Parameter, value: bool) -> None:
        if value and not ctx.resilient_parsing:
            self._all_shown = True
            click.echo(ctx.get_help())
            ctx.exit()


def typed_options(ctx: click.Context) -> Iterator[str]:
    """Yield the names that are typed, and with a word for a value NAME VALUE, too."""
    for param in ctx.command.params:
        if ctx.get_parameter_source(param.name or "") is not ParameterSource.COMMANDLINE:
            continue
        name, value = name_of(param), ctx.params.get(param.name or "")
        yield next(iter(param.secondary_opts), name) if value is False else name
        for one in value if isinstance(value, tuple) else (value,):
            yield f"{name} {one}"


def name_of(param: click.Parameter) -> str:
    """Return the longest name of an option, as people type it; of an argument its metavar."""
    if isinstance(param, click.Argument):
        return param.metavar or (param.name or "").upper()
    return max(param.opts, key=len)
