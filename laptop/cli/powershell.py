"""Completion by the Tab key in PowerShell, which click leaves to others."""

from __future__ import annotations

import os

from click.shell_completion import CompletionItem, ShellComplete, split_arg_string

SCRIPT = """\
Register-ArgumentCompleter -Native -CommandName %(prog_name)s -ScriptBlock {
    param($word, $line, $cursor)
    $env:COMP_WORDS = $line.ToString()
    $env:COMP_CWORD = $word
    $env:%(complete_var)s = "powershell_complete"
    %(prog_name)s | ForEach-Object {
        $value, $help = $_ -split "`t", 2
        [Management.Automation.CompletionResult]::new($value, $value, "ParameterValue", $help)
    }
    Remove-Item Env:COMP_WORDS, Env:COMP_CWORD, Env:%(complete_var)s
}
"""


class PowerShellComplete(ShellComplete):
    """What PowerShell asks, and how it is answered: a word and what it is, with a tab between."""

    name = "powershell"
    source_template = SCRIPT

    def get_completion_args(self) -> tuple[list[str], str]:
        """Return the words that are typed before, and the one that is to be completed."""
        _, *args = split_arg_string(os.environ["COMP_WORDS"])
        begun = os.environ["COMP_CWORD"]
        if begun and args[-1:] == [begun]:
            args.pop()
        return args, begun

    def format_completion(self, item: CompletionItem) -> str:
        """Return a line for PowerShell; it wants some help, too."""
        return f"{item.value}\t{item.help or item.value}"
