"""`calibeam completion`: what a shell needs to complete commands and options."""

from typing import Literal

from calibeam import cli
from calibeam.command_list import COMMANDS


def completion_command(shell: Literal["bash", "zsh", "fish"]) -> None:
    """Print the completion script of a shell.

    For example:

    ```
    calibeam completion bash > ~/.local/share/bash-completion/completions/calibeam
    calibeam completion fish > ~/.config/fish/completions/calibeam.fish
    calibeam completion zsh > "${fpath[1]}/_calibeam"
    ```

    Parameters
    ----------
    shell
        The shell that reads it.

    """
    for name in COMMANDS:
        cli.app[name]  # loads it: its options are completed, too
    print(cli.app.generate_completion(prog_name="calibeam", shell=shell))
