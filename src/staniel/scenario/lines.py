"""Where in a TOML text each key stands, so that a message can name the line."""

import re
import tomllib

__all__ = ["find_line", "key_lines"]

_TOKEN = re.compile(
    r'"""(?:\\.|[^\\])*?"{3,5}'  # multi-line strings first: they hide everything inside
    r"|'''.*?'{3,5}"
    r'|"(?:\\.|[^"\\\n])*"'
    r"|'[^'\n]*'"
    r"|\#[^\n]*"
    r"|[\[\]{}=\n]"
    r"|[A-Za-z0-9_-]+"
    r"|.",
    re.DOTALL,
)
_NAME = re.compile(r"""[A-Za-z0-9_"'-]""")

Path = tuple[str | int, ...]


def key_lines(text: str) -> dict[Path, int]:
    r"""Line of each key and table header of a valid TOML text.

    Parameters
    ----------
    text : str
        What `tomllib` has accepted; this reader checks nothing again.

    Returns
    -------
    dict of tuple of str and int to int
        From the path of a key to its line, counted from 1. Tables of a list have their number in
        the path, counted from 0. Keys in inline tables are left out.

    Examples
    --------
    >>> key_lines("seed = 3\n[city]\nsize = [\n 1, 2]\n")
    {('seed',): 1, ('city',): 2, ('city', 'size'): 3}
    >>> key_lines("[[part]]\nlength = 1\n[[part]]\nlength = 2")[("part", 1, "length")]
    4
    """
    lines: dict[Path, int] = {}
    table: Path = ()
    path: list[str] = []
    counts: dict[Path, int] = {}
    header = in_value = False
    depth, number, brackets = 0, 1, 0
    for match in _TOKEN.finditer(text + "\n"):
        token = match[0]
        if token == "\n" and depth == 0:
            if header:
                table = _numbered(path, counts, brackets == 2)
                lines.setdefault(tuple(path), number)
                lines.setdefault(table, number)
            path, header, in_value, brackets = [], False, False, 0
        elif in_value:
            depth += (token in "[{") - (token in "]}")
        elif token == "[":
            header = True
            brackets += 1
        elif token == "=":
            in_value = True
            lines.setdefault((*table, *path), number)
        elif _NAME.match(token):
            path.append(_unquote(token))
        number += token.count("\n")
    return lines


def find_line(lines: dict[Path, int], path: Path) -> int | None:
    """Line of a key, or of the nearest thing around it that has one."""
    for length in range(len(path), 0, -1):
        line = lines.get(path[:length])
        if line is not None:
            return line
    return None


def _numbered(names: list[str], counts: dict[Path, int], is_list: bool) -> Path:
    """Path of a table header, with the numbers of the lists of tables that it lies in."""
    path: list[str | int] = []
    for place, name in enumerate(names):
        path.append(name)
        here = tuple(path)
        if is_list and place == len(names) - 1:
            counts[here] = counts.get(here, 0) + 1
        if here in counts:
            path.append(counts[here] - 1)
    return tuple(path)


def _unquote(token: str) -> str:
    if token[0] in "\"'":
        return str(tomllib.loads(f"key = {token}")["key"])
    return token
